"""Detectors on real data: SKAB and the Tennessee Eastman recordings of Russell, Chiang and Braatz."""

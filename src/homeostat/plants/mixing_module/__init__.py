"""The Mixing Module: three feed tanks, a collecting tank, a main and a bypass pump; one batch per run."""

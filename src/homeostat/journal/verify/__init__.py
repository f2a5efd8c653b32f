"""Is a run what it was when it was written, and does it agree with itself?"""

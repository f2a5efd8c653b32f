"""The Tennessee Eastman plant beside its published code, alone and looked after."""

"""A plant attached over OPC UA, disturbed, killed and left alone for days: what it keeps, and how soon it is back."""

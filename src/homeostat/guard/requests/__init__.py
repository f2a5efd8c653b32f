"""Requests and people's orders: authorised, verified, refused with a reason."""

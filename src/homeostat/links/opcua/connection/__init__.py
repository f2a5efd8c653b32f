"""The connection: one session after the other, in a thread of its own, and what they bring."""

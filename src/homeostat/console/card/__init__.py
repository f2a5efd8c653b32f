"""The card of an episode: what is wrong, what is proposed, why it is safe, how long is left."""

"""The deterministic proposer: planning by enumeration, action by search, reprompting by margins."""

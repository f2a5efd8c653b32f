"""The refusal of a campaign."""


class CampaignError(ValueError):
    """A campaign cannot be carried out as it was asked for; the message says why in one line."""

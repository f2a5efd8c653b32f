"""Ways to misbehave, by the name of the model that is asked for."""

from __future__ import annotations

from tests.llm.hostile import answers, responses, statuses, strangers, transport
from tests.llm.hostile.wire import REGISTERED, Behaviour

BEHAVIOURS: dict[str, Behaviour] = {
    name: function
    for module in (statuses, transport, responses, answers, strangers)
    for name, function in REGISTERED.items()
    if function.__module__ == module.__name__
}
"""Name of the model -> what its server does."""

"""The event of a question to a language model."""

from dataclasses import dataclass
from typing import ClassVar

from homeostat.journal.events import Setting


@dataclass(frozen=True, slots=True)
class ModelCalled:
    """A language model was asked, and answered or failed."""

    kind: ClassVar[str] = "model-called"
    agent: str
    """Who asked: ``planning``, ``action`` or ``reprompting``."""
    model: str
    """Model that was asked for."""
    served: str
    """Model that answered, as the server names it; empty where none did."""
    settings: tuple[Setting, ...]
    """How it samples: temperature, seed, way of asking for JSON."""
    template_sha256: str
    """Hash of the prompt files."""
    prompt_sha256: str
    """Hash of what the model saw, and name of its file in the run directory."""
    schema_sha256: str
    """Hash of the JSON schema that was asked for, and name of its file."""
    answer_sha256: str
    """Hash of the answer, and name of its file; empty where there is none."""
    failure: str
    """Name of the failure; empty where there is an answer."""
    detail: str
    """The failure in one line."""
    input_tokens: int
    """Tokens read, by the server's count; 0 where it is not known."""
    output_tokens: int
    """Tokens written, by the server's count; 0 where it is not known."""
    cost_usd: float | None
    """Price by the provider's list [USD]; None where it is not known."""
    wall_requests: int
    """Requests that were sent; how many fit into the time depends on the wall clock."""
    wall_latency_s: float
    """Wall-clock time from the question to its end [s]."""

"""Language models by name: from what a user writes to somebody who answers."""

from dataclasses import dataclass
from pathlib import Path

from homeostat.llm.model import LanguageModel, ModelError

REPLAY, SITUATED, SCRIPT = "replay:", "situated:", "scripted:"
MODELS = (
    "openai:MODEL, anthropic:MODEL, ollama:MODEL, http://HOST:PORT/v1#MODEL, replay:FILE, situated:FILE, "
    "scripted:reasonable, scripted:stubborn"
)
"""Forms that a name may have."""


class NoSuchModel(ValueError):
    """Nobody answers to a name; the message says why in one line."""


@dataclass(frozen=True, slots=True)
class NamedModel:
    """A language model as it was asked for; can be sent to another process, where it is made."""

    name: str
    """One of the forms of :data:`MODELS`."""
    local_only: bool = False
    """Whether models that are not on this machine are refused."""
    allow_hosts: tuple[str, ...] = ()
    """Hosts that are allowed beside it."""
    temperature: float = 0.0
    """Temperature of the sampling [1]."""
    seed: int | None = None
    """Seed of the model's own sampling, if it has one."""

    @property
    def recorded(self) -> Path | None:
        """The file of recorded answers; None where a model is asked."""
        return next((Path(self.name.removeprefix(k)) for k in (REPLAY, SITUATED) if self.name.startswith(k)), None)

    def make(self) -> LanguageModel:
        """The model, ready to be asked; NoSuchModel where there is none."""
        if self.recorded is not None:
            return self._replayed(self.recorded)
        return self._scripted() if self.name.startswith(SCRIPT) else self._provider()

    def _replayed(self, path: Path) -> LanguageModel:
        from homeostat.llm.calls import CallFileError, read_calls
        from homeostat.llm.replay import ReplayModel, SituatedReplay

        replay = SituatedReplay if self.name.startswith(SITUATED) else ReplayModel
        try:
            return replay(f"{self.name.partition(':')[0]}:{path.name}", read_calls(path))
        except CallFileError as error:
            raise NoSuchModel(str(error)) from error

    def _scripted(self) -> LanguageModel:
        from homeostat.agents.language.scripts import SCRIPTS
        from homeostat.llm.scripted import ScriptedModel

        script = SCRIPTS.get(self.name.removeprefix(SCRIPT))
        if script is None:
            known = ", ".join(f"{SCRIPT}{s}" for s in SCRIPTS)
            raise NoSuchModel(f"there is no script {self.name!r}; there are {known}")
        return ScriptedModel(self.name, script)

    def _provider(self) -> LanguageModel:
        from homeostat.llm.address import check_host, parse_address

        try:
            for host in self.allow_hosts:
                check_host(host)
        except ValueError as error:
            raise NoSuchModel(f"--allow-host: {error}") from None
        try:
            address = parse_address(self.name)
        except ValueError as error:
            raise NoSuchModel(f"unknown proposer: {error}; or one of search, {MODELS}") from None
        try:
            from homeostat.llm.network import AddressPolicy
            from homeostat.llm.providers import ProviderModel, Sampling
            from homeostat.llm.retry import RetryingModel
        except ImportError as error:
            raise NoSuchModel(f"asking {address.text!r} needs {error.name!r}: pip install 'homeostat[llm]'") from error
        policy, sampling = AddressPolicy(self.local_only, self.allow_hosts), Sampling(self.temperature, self.seed)
        try:
            return RetryingModel(ProviderModel(address, policy, sampling))
        except ModelError as error:
            raise NoSuchModel(str(error)) from error

"""Addresses of models, as the command line spells them."""

import ipaddress
import os
import re
from dataclasses import dataclass
from typing import Final
from urllib.parse import urldefrag

OPENAI, ANTHROPIC, OLLAMA, SERVER = "openai", "anthropic", "ollama", "server"
_KNOWN: Final = {
    OPENAI: ("https://api.openai.com/v1", "OPENAI_API_KEY"),
    ANTHROPIC: ("https://api.anthropic.com", "ANTHROPIC_API_KEY"),
    OLLAMA: ("http://127.0.0.1:11434/v1", "OLLAMA_API_KEY"),
}
"""Provider -> where it is, and the environment variable with its key."""
_HOST: Final = re.compile(r"[\w-]+(\.[\w-]+)*\.?")
SERVER_KEY: Final = "HOMEOSTAT_LLM_KEY"
"""Environment variable with the key of a server that is given by its address."""
KEY_VARIABLES: Final = (*(variable for _, variable in _KNOWN.values()), SERVER_KEY)
"""Every environment variable that may hold a key."""


@dataclass(frozen=True, slots=True)
class ModelAddress:
    """Which model, and where."""

    text: str
    """As it was given."""
    provider: str
    """``openai``, ``anthropic``, ``ollama``, or ``server`` for an OpenAI-compatible one."""
    model: str
    """Name that the server knows it by."""
    url: str
    """Base address of its interface."""
    key_variable: str
    """Environment variable that holds its key."""

    @property
    def needs_key(self) -> bool:
        """Whether nothing is answered without a key."""
        return self.provider in (OPENAI, ANTHROPIC)

    def key(self) -> str:
        """Its key in the environment, without the line break that a file leaves at its end; empty for none."""
        return os.environ.get(self.key_variable, "").strip()


def parse_address(text: str) -> ModelAddress:
    """The address in ``text``: ``openai:MODEL``, ``anthropic:MODEL``, ``ollama:MODEL`` or ``http://HOST:PORT/v1#MODEL``.

    Raises ValueError, naming the forms, for anything else.

    >>> parse_address("ollama:qwen3:8b").model
    'qwen3:8b'
    >>> parse_address("http://127.0.0.1:8000/v1#tiny").url
    'http://127.0.0.1:8000/v1'
    """
    if _may_hold_a_secret(text):  # it would be recorded with every call, so not even this message repeats it
        raise ValueError(
            "the address has a user name, a password or a query in it; "
            f"give a key in the environment, as {SERVER_KEY}, and the address as http://HOST:PORT/v1#MODEL"
        )
    if text.startswith(("http://", "https://")):
        try:
            url, model = urldefrag(text)
        except ValueError as error:
            raise ValueError(f"{text!r} is not an address ({error}); it must be http://HOST:PORT/v1#MODEL") from None
        if not model:
            raise ValueError(f"{text!r} names no model; add it after a '#': {text}#MODEL")
        return ModelAddress(text, SERVER, model, url, SERVER_KEY)
    provider, colon, model = text.partition(":")
    if not colon or provider not in _KNOWN or not model:
        forms = ", ".join(f"{name}:MODEL" for name in _KNOWN)
        raise ValueError(f"{text!r} names no model; it must be {forms} or http://HOST:PORT/v1#MODEL")
    url, variable = _KNOWN[provider]
    return ModelAddress(text, provider, model, url, variable)


def check_host(text: str) -> None:
    """ValueError where ``text`` is not the name or the address of a host alone: it would never be the one reached.

    >>> check_host("llm.plant.example")
    """
    if _HOST.fullmatch(text):
        return
    try:
        ipaddress.ip_address(text)  # one of version 6 has colons
    except ValueError:
        raise ValueError(f"{text!r} is not a host; give its name alone, without http://, port and path") from None


def _may_hold_a_secret(text: str) -> bool:
    """Whether ``text`` looks like an address with more than a place and a model; a password may have a '#' in it."""
    if "//" not in text or text.partition(":")[0] in _KNOWN:
        return False
    url, _, model = text.partition("#")
    host_follows = "/" in model[1:].partition("@")[2]  # a name may begin with '@'
    return "@" in url or "?" in text or "#" in model or host_follows

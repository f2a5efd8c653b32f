"""Addresses of models: four forms, and one line for everything else."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.llm.address import KEY_VARIABLES, ModelAddress, parse_address
from homeostat.llm.model import ModelError
from homeostat.llm.network import AddressPolicy

FORMS = [
    ("openai:gpt-4.1-mini", "openai", "gpt-4.1-mini", "https://api.openai.com/v1", "OPENAI_API_KEY"),
    ("anthropic:claude-sonnet-4-6", "anthropic", "claude-sonnet-4-6", "https://api.anthropic.com", "ANTHROPIC_API_KEY"),
    ("ollama:qwen3:8b", "ollama", "qwen3:8b", "http://127.0.0.1:11434/v1", "OLLAMA_API_KEY"),
    ("http://127.0.0.1:8000/v1#tiny", "server", "tiny", "http://127.0.0.1:8000/v1", "HOMEOSTAT_LLM_KEY"),
    ("https://llm.plant.example/v1#org/name:7b", "server", "org/name:7b", "https://llm.plant.example/v1",
     "HOMEOSTAT_LLM_KEY"),
    ("http://[::1]:8000/v1#tiny", "server", "tiny", "http://[::1]:8000/v1", "HOMEOSTAT_LLM_KEY"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "provider", "model", "url", "variable"), FORMS, ids=[f[0] for f in FORMS])
def test_the_four_forms(text: str, provider: str, model: str, url: str, variable: str) -> None:
    assert parse_address(text) == ModelAddress(text, provider, model, url, variable)
    assert variable in KEY_VARIABLES, "whatever is in it must be struck out"


@pytest.mark.parametrize(
    "text",
    ["", ":", "openai", "openai:", ":gpt", "gpt-4", "opanai:gpt-4", "OpenAI:gpt-4", "ftp://host/v1#m", "//host/v1#m",
     "file:///etc/passwd#m", "search", " openai:gpt"],
)  # fmt: skip
def test_what_names_no_model_is_refused_with_the_forms(text: str) -> None:
    with pytest.raises(ValueError, match="MODEL") as refused:
        parse_address(text)
    message = str(refused.value)
    assert repr(text) in message and "\n" not in message
    assert all(form in message for form in ("openai:MODEL", "ollama:MODEL", "http://HOST:PORT/v1#MODEL"))


@pytest.mark.parametrize("text", ["http://127.0.0.1:8000/v1", "https://host/v1#", "http://"])
def test_a_server_without_model_is_told_where_to_put_it(text: str) -> None:
    with pytest.raises(ValueError, match=r"#MODEL") as refused:
        parse_address(text)
    assert repr(text) in str(refused.value) and "\n" not in str(refused.value)


@given(st.text(max_size=40) | st.builds(str.__add__, st.sampled_from(["http://", "openai:", "ollama:"]), st.text()))
def test_any_text_is_an_address_or_a_value_error(text: str) -> None:
    try:
        address = parse_address(text)
    except ValueError:
        return
    assert address.text == text and address.model and address.url and address.key_variable in KEY_VARIABLES


@given(st.text(max_size=20), st.sampled_from(["[", "[::1", "]", "[::1]x", "[v1.x]", "", "@", ":", "a:b:c"]))
def test_any_server_is_allowed_or_a_model_error(rest: str, host: str) -> None:
    """What parses is judged by the policy, and whatever it says is a value error or a model error."""
    try:
        address = parse_address(f"http://{host}{rest}/v1#m")
    except ValueError:
        return
    try:
        AddressPolicy(local_only=True).check(address.url)
    except ModelError as refused:
        assert "\n" not in str(refused)


@pytest.mark.parametrize(
    "url",
    ["http://user:hunter2@10.0.0.1/v1", "https://hunter2@host/v1", "http://h/v1?key=hunter2",
     "http://user:p#hunter2@10.0.0.1/v1", "HTTP://user:hunter2@host/v1", "http://user:hunter2@[::1/v1",
     "ftp://user:hunter2@host/v1", "//user:hunter2@host/v1", "http://h/v1#m?key=hunter2"],
)  # fmt: skip
def test_an_address_with_a_secret_is_refused_without_repeating_it(url: str) -> None:
    for text in (url, f"{url}#model"):
        with pytest.raises(ValueError, match="HOMEOSTAT_LLM_KEY") as error:
            parse_address(text)
        assert "hunter2" not in str(error.value)


@pytest.mark.parametrize("model", ["@cf/meta/llama-3", "org/name@2024", "name@2024"])
def test_a_model_may_have_an_at_sign(model: str) -> None:
    assert parse_address(f"http://host/v1#{model}").model == model
    assert parse_address(f"ollama:{model}").model == model

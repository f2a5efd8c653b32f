"""A language model's words on the page: marked as its own, no markup, and only for who may ask."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.console.served import Browser, accounts, served
from tests.console.test_hostile import MARKUP
from tests.llm.replying import replying

pytestmark = pytest.mark.slow

pytest.importorskip("pydantic_ai", reason="the extra 'llm' is not installed")


def chat(text: str) -> bytes:
    """An answer of a server that speaks as OpenAI's does."""
    message = {"role": "assistant", "content": json.dumps({"text": text})}
    choice = {"index": 0, "finish_reason": "stop", "message": message}
    usage = {"prompt_tokens": 1, "completion_tokens": 1, "total_tokens": 2}
    told = {"id": "1", "object": "chat.completion", "created": 1, "model": "tiny", "choices": [choice], "usage": usage}
    return json.dumps(told).encode()


def test_on_the_page_its_words_are_marked_and_no_markup(page: Any, recovered_run: Path) -> None:
    said = f"Das Kühlventil klemmt. {MARKUP} 4711 K."
    with (
        replying(body=chat(said), headers={"Content-Type": "application/json"}) as model,
        served(recovered_run, "--explain-with", f"{model.url}/v1#tiny", "--local-only") as server,
    ):
        page.goto(server.address)
        page.wait_for_selector(".answers")
        page.locator("summary", has_text="In words").click()
        page.get_by_label("say it in").select_option("de")
        page.get_by_role("button", name="Ask it").click()
        words = page.locator(".retold blockquote")
        words.wait_for()
        text = words.inner_text()
        assert "not checked. The facts above count" in text and "Numbers that are not in the facts: 4711" in text
        assert MARKUP in text and page.locator("img").count() == 0 and page.title() != "taken"
        assert b"Cooling valve stuck" in model.bodies[0] and b"cool_stuck_closed" not in model.bodies[0]


def test_a_viewer_asks_no_model_and_a_console_without_one_has_none(recovered_run: Path, tmp_path: Path) -> None:
    people = accounts(tmp_path / "people.json", vi="viewer")
    with replying() as model:
        options = "--people", str(people), "--explain-with", f"{model.url}/v1#tiny", "--local-only"
        with served(recovered_run, *options) as server:
            vi = Browser(server)
            vi.sign_in("vi")
            assert vi.send("/api/retold", {"at_s": 1000.0, "language": "de"}).status == 403
        assert model.bodies == []
    with served(recovered_run) as server:
        headers = {"Content-Type": "application/json", "Origin": server.address.rstrip("/")}
        asked = server.ask("/api/retold", "POST", b'{"at_s": 1000, "language": "de"}', **headers)
        assert asked.status == 404 and server.ask("/api/run").json["model"] == ""

"""``python -m tests.llm.random_model --port 0 --seed N``: serve until killed; prints ``listening on PORT``."""

from __future__ import annotations

import argparse

from tests.llm.random_model.server import Server

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--port", type=int, default=0)
parser.add_argument("--seed", type=int, default=0)
options = parser.parse_args()
server = Server(options.port, options.seed)
print(f"listening on {server.server_port}", flush=True)
server.serve_forever()

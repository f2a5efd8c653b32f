"""What the published models answered, as files of calls that this project's loop can be told again.

The records of the published studies are not part of this project. ``python -m benchmarks.published_answers --records
FOLDER --out FOLDER`` converts them; :class:`homeostat.llm.replay.SituatedReplay` says the answers again, each in the
state in which it was given. ``python -m benchmarks.published_answers.measure --records FOLDER`` shows what comes of it.
"""

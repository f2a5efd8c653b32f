"""``homeostat export-console``: a recorded run's page as one file."""

import argparse
from dataclasses import replace

from homeostat.cli.arguments import writable
from homeostat.cli.commands.console import opened
from homeostat.cli.run_directory import run_directory
from homeostat.console.events.lines import verified
from homeostat.console.kept.page import kept_page
from homeostat.console.kept.record import kept_record
from homeostat.domain.quotation import printable
from homeostat.journal.beside.files import write_whole


def carry_out(options: argparse.Namespace) -> int:
    """Write the file and print where it is; 0."""
    run_dir = run_directory(options.run)
    out = writable(options.out, options.force)
    run = opened(run_dir, options.case)
    said = verified(run_dir)
    notice = f"A file made from a run; nothing in it is live. Its journal, when it was made: {said.text}."
    record = kept_record(run, said, notice)
    if options.beside is not None:
        beside = run_directory(options.beside)
        other = kept_record(opened(beside, options.case), verified(beside), "")
        record |= {"run": replace(record["run"], beside=True), "other": other}
    page = kept_page(record, run.plant.title).encode()
    write_whole(out, page)
    print(printable(f"{options.out}: {len(page) / 1e6:.1f} MB, up to {run.last_s:.0f} s of process time"))
    return 0

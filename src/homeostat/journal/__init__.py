"""Everything that happened, in order: typed events in an append-only, hash-chained journal, and the files beside it."""

from homeostat.journal.beside.files import StoredFile
from homeostat.journal.beside.manifest import Manifest, Summary
from homeostat.journal.events import Event, Resumed, RunFinished, RunStarted, Setting, Signed, Subscriber, Trace
from homeostat.journal.followed import Followed
from homeostat.journal.journal import Journal
from homeostat.journal.memory import MemoryTrace
from homeostat.journal.reading import BrokenChain, Record, read_events
from homeostat.journal.signing.signatures import Signature
from homeostat.journal.verify.verify import Report

__all__ = [
    "BrokenChain",
    "Event",
    "Followed",
    "Journal",
    "Manifest",
    "MemoryTrace",
    "Record",
    "Report",
    "Resumed",
    "RunFinished",
    "RunStarted",
    "Setting",
    "Signature",
    "Signed",
    "StoredFile",
    "Subscriber",
    "Summary",
    "Trace",
    "read_events",
]

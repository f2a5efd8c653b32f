"""Everything that happened, in order: typed events in an append-only, hash-chained journal, and the files beside it."""

from homeostat.trace.events import Event, Resumed, RunFinished, RunStarted, Setting, Signed, Subscriber, Trace
from homeostat.trace.files import StoredFile
from homeostat.trace.followed import Followed
from homeostat.trace.journal import Journal
from homeostat.trace.manifest import Manifest, Summary
from homeostat.trace.memory import Entry, MemoryTrace
from homeostat.trace.replay import BrokenChain, Record, read_events
from homeostat.trace.signatures import Signature, Vouched
from homeostat.trace.verify import Report, verify

__all__ = [
    "BrokenChain",
    "Entry",
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
    "Vouched",
    "read_events",
    "verify",
]

"""The store of a fleet: one SQLite file, a row a fit, readable with any SQLite tool."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from friction_ocp.errors import Finding, FrictionOcpError

FORMAT = "friction-ocp-fleet/1"
_SCHEMA = """
CREATE TABLE IF NOT EXISTS meta (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS fits (
    key TEXT PRIMARY KEY,      -- content of recording, problem and toolkit: equal key, equal fit
    problem TEXT NOT NULL,     -- fingerprint of problem and toolkit: fits that can be compared
    machine TEXT NOT NULL,
    recording TEXT NOT NULL,   -- file as given
    started TEXT NOT NULL,     -- ISO 8601, or empty
    sha256 TEXT NOT NULL,      -- of the recording
    status TEXT NOT NULL,      -- converged, not_converged or failed
    message TEXT NOT NULL,
    seconds REAL NOT NULL,
    created TEXT NOT NULL,     -- when it was fitted, ISO 8601
    document TEXT NOT NULL     -- JSON: errors of the free run, warnings, provenance
);
CREATE TABLE IF NOT EXISTS parameters (
    fit TEXT NOT NULL REFERENCES fits (key) ON DELETE CASCADE,
    name TEXT NOT NULL,
    value REAL NOT NULL,
    std_error REAL,            -- robust; NULL where there is none
    low REAL, high REAL,       -- 95 % interval
    unit TEXT NOT NULL,
    verdict TEXT NOT NULL,
    PRIMARY KEY (fit, name)
);
"""


@dataclass(frozen=True)
class StoredParameter:
    """One estimate."""

    name: str
    value: float
    std_error: float | None
    low: float | None
    high: float | None
    unit: str
    verdict: str


@dataclass(frozen=True)
class StoredFit:
    """One row: what was fitted, how it ended and what came of it."""

    key: str
    problem: str
    machine: str
    recording: str
    started: str
    sha256: str
    status: str
    message: str
    seconds: float
    created: str
    document: Mapping[str, Any]
    parameters: tuple[StoredParameter, ...] = ()


@dataclass(frozen=True)
class Store:
    """Fits in a file. Every change is a transaction: after a power cut a fit is there whole or not at all."""

    path: Path

    def fits(self, problem: str) -> list[StoredFit]:
        """Return all fits of one problem, by machine and time."""
        with self._opened() as connection:
            rows = connection.execute(
                f"SELECT {_COLUMNS} FROM fits WHERE problem = ? ORDER BY machine, started, recording", (problem,)
            ).fetchall()
            found = connection.execute(
                "SELECT fit, name, value, std_error, low, high, unit, verdict FROM parameters "
                "WHERE fit IN (SELECT key FROM fits WHERE problem = ?) ORDER BY rowid",
                (problem,),
            ).fetchall()
        parameters: dict[str, list[StoredParameter]] = {}
        for fit, *values in found:
            parameters.setdefault(fit, []).append(StoredParameter(*values))
        return [_fit(row, tuple(parameters.get(row[0], ()))) for row in rows]

    def others(self, problem: str) -> int:
        """Return how many fits of other problems or versions there are."""
        with self._opened() as connection:
            return int(connection.execute("SELECT count(*) FROM fits WHERE problem <> ?", (problem,)).fetchone()[0])

    def add(self, fit: StoredFit) -> None:
        """Add a fit, or put it in the place of the one with the same key."""
        values = [getattr(fit, name) for name in _NAMES[:-1]] + [json.dumps(fit.document, allow_nan=False)]
        marks = ", ".join("?" for _ in values)
        with self._opened() as connection:
            connection.execute(f"INSERT OR REPLACE INTO fits ({_COLUMNS}) VALUES ({marks})", values)
            connection.executemany(
                "INSERT OR REPLACE INTO parameters (fit, name, value, std_error, low, high, unit, verdict) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    (fit.key, item.name, item.value, item.std_error, item.low, item.high, item.unit, item.verdict)
                    for item in fit.parameters
                ],
            )

    def place(self, places: Sequence[tuple[str, str, str, str]]) -> None:
        """State machine, recording and time of fits anew, (key, machine, recording, started) each."""
        rows = [(machine, recording, started, key) for key, machine, recording, started in places]
        with self._opened() as connection:
            connection.executemany("UPDATE fits SET machine = ?, recording = ?, started = ? WHERE key = ?", rows)

    @contextmanager
    def _opened(self) -> Generator[sqlite3.Connection]:
        """Open the file, made where there is none; commit at the end, or nothing at all."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with closing(sqlite3.connect(self.path, timeout=30.0)) as connection, connection:
                connection.executescript(_SCHEMA)
                connection.execute("INSERT OR IGNORE INTO meta VALUES ('format', ?)", (FORMAT,))
                found = connection.execute("SELECT value FROM meta WHERE name = 'format'").fetchone()[0]
                if found != FORMAT:
                    raise FrictionOcpError(Finding(str(self.path), f"its format is '{found}'", f"'{FORMAT}'"))
                yield connection
        except sqlite3.Error as error:
            what = f"this cannot be used as a store of fits ({error})"
            raise FrictionOcpError(
                Finding(str(self.path), what, remedy="move it away, or give another --out")
            ) from error


_NAMES = (
    "key",
    "problem",
    "machine",
    "recording",
    "started",
    "sha256",
    "status",
    "message",
    "seconds",
    "created",
    "document",
)
_COLUMNS = ", ".join(_NAMES)


def _fit(row: Sequence[Any], parameters: tuple[StoredParameter, ...]) -> StoredFit:
    return StoredFit(*row[:-1], document=json.loads(row[-1]), parameters=parameters)


def now() -> str:
    """Return the time, ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="seconds")

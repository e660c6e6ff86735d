"""Runs the tests of a pytest session against seeded faults: first all as they are, then those that a fault touches."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from _pytest.runner import runtestprotocol

from glbump.glsltest.glsl import Glsl
from glbump.glsltest.mutants import Mutant, Outcome, chosen, mutants_of, read_known


class Anchor(pytest.Item):
    """The test that comes next, always: what belongs to the session stays set up, all else is taken down."""

    def runtest(self) -> None:
        """Never run."""


class MutationRun:
    """A plugin of one session: replaces its test loop, and prints what became of the faults."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.outcome: Outcome | None = None
        self.note = ""
        # Test -> the (file, function) of shaders that it called, directly or not.
        self.called: dict[pytest.Item, set[tuple[str, str]]] = {}
        self.glsl: Glsl | None = None

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Learn which functions a test calls."""
        self.glsl = getattr(item, "funcargs", {}).get("glsl", self.glsl)
        if self.glsl is not None and self.outcome is None:
            self.glsl.called = self.called.setdefault(item, set())
        return (yield)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool | None:
        """The ordinary loop, then one run for each fault."""
        if session.config.option.collectonly or session.testsfailed:
            return None
        anchor = Anchor.from_parent(session, name="glsl-mutants")
        for item in session.items:
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=anchor)
            if session.shouldfail or session.shouldstop:
                break
        if session.testsfailed:
            self.note = "no faults seeded: the tests fail as they are"
        elif self.glsl is None:
            self.note = "no faults seeded: no test uses glsl"
        else:
            self.outcome = Outcome([], [], [], [])
            for mutant in self._mutants():
                self._try(mutant, anchor)
            self.glsl.mutant = None
        session._setupstate.teardown_exact(None)
        return True

    def _mutants(self) -> list[Mutant]:
        told = Path(self.config.getoption("--glsl-mutants"))
        files = sorted(told.rglob("*.glsl")) if told.is_dir() else [told]
        every = [mutant for file in files for mutant in mutants_of(file)]
        return chosen(
            every, self.config.getoption("--glsl-mutants-count"), self.config.getoption("--glsl-mutants-seed")
        )

    def _try(self, mutant: Mutant, anchor: Anchor) -> None:
        assert self.outcome is not None
        assert self.glsl is not None
        touched = [item for item, called in self.called.items() if (mutant.file, mutant.function) in called]
        if not touched:
            self.outcome.untested.append(mutant)
            return
        self.glsl.mutant, self.glsl.stillborn = mutant, False
        for item in touched:
            reports: list[Any] = runtestprotocol(item, log=False, nextitem=anchor)
            if self.glsl.stillborn:
                self.outcome.stillborn.append(mutant)
                return
            if any(report.failed for report in reports):
                self.outcome.killed.append(mutant)
                return
        self.outcome.survived.append(mutant)

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Fail when less than --glsl-mutants-min were killed."""
        least = self.config.getoption("--glsl-mutants-min")
        if self.outcome is None or least is None:
            return
        if 100 * self.outcome.share < least and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """What became of the faults."""
        terminalreporter.section("seeded faults")
        path = self.config.getoption("--glsl-mutants-known")
        lines = self.outcome.report(read_known(Path(path)) if path else []) if self.outcome else [self.note]
        for line in lines:
            terminalreporter.write_line(line)

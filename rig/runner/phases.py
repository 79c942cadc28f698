"""The halves of a run: the calibration, and the same movement again to verify what the board made of it.

Each half is recorded into a file of its own. Nothing ends a half without its reason in the run's log and, where data
were kept, the command to go on with.
"""

import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from firmware_host.errors import BoardError
from rig.analysis.onboard_check import check_observed
from rig.analysis.outcome import Outcome, outcome_of, verified
from rig.board.store import store_calibrations
from rig.config.load import Loaded
from rig.data.run_file import RunData, make_plain, read_run
from rig.data.run_folder import CALIBRATION, VERIFICATION, next_recording, recordings, resuming
from rig.errors import Fault, Refused, RigError
from rig.report.writers import write_outcome
from rig.runner.connect import open_rig
from rig.runner.procedure import Confirm, Rig
from rig.station.view import View

Script = Callable[[Rig], None]


@dataclass(frozen=True, slots=True)
class Session:
    """One run in its folder; the laboratory, if it is a simulated one, is there already.

    `verification` is the script of the second half.
    """

    folder: Path
    loaded: Loaded
    shown: View
    confirm: Confirm
    verification: Script

    def calibrate(self, script: Script) -> Outcome:
        """Calibrate by `script`; if the configuration asks for it and the limits are met, store and verify.

        Writes the outcome into the folder and returns it.
        """
        files = recordings(self.folder, CALIBRATION)
        self._record(script, CALIBRATION, earlier=[read_run(file) for file in files])
        with self.reported(self._repeating, moved=True):
            for file in files:
                make_plain(file)  # if the run was killed, only readers that know about it could open its file
            runs = [read_run(file) for file in recordings(self.folder, CALIBRATION)]
            outcome = outcome_of(runs)
            check_observed(runs[-1], self.loaded.config.to_calibrate)
            if not self.loaded.config.procedure.then_verify:
                return self._written(outcome)
        if outcome.passed:
            with self.reported(self._mended, moved=True):
                for line in store_calibrations(self.loaded.config, outcome.results):
                    self.shown.line(line)
            self._record(self.verification, VERIFICATION, calibrated=True, moved=True)
        else:
            self.shown.line("not verified: the calibration failed its limits, so the board keeps what it had")
        with self.reported(self._repeating, moved=True):
            repeated = [self._newest_verification()] if outcome.passed else []
            return self._written(verified(outcome, repeated))

    def verify(self, script: Script) -> Outcome:
        """Only the second half, with the calibration the board has stored. Returns the outcome."""
        self._record(script, VERIFICATION, calibrated=True)
        with self.reported(self._repeating, moved=True):
            return self._written(outcome_of([], [self._newest_verification()]))

    @property
    def _mended(self) -> str:
        return f"the data are kept in {self.folder}; when it is mended, go on with: {resuming(self.folder)}"

    @property
    def _repeating(self) -> str:
        return f"the data are kept in {self.folder}; to repeat refused sweeps: {resuming(self.folder)}"

    def _newest_verification(self) -> RunData:
        return read_run(recordings(self.folder, VERIFICATION)[-1])

    def _record(
        self,
        script: Script,
        kind: str,
        *,
        earlier: Sequence[RunData] = (),
        calibrated: bool = False,
        moved: bool = False,
    ) -> None:
        recording = next_recording(self.folder, kind)
        with (
            self.reported(self._mended, moved=moved),
            open_rig(
                self.loaded,
                recording,
                self.shown,
                self.confirm,
                earlier=earlier,
                calibrated=calibrated,
                announced=moved,
            ) as rig,
        ):
            script(rig)
            self.shown.line(rig.summary())

    def _written(self, outcome: Outcome) -> Outcome:
        for line in write_outcome(self.folder, outcome):
            self.shown.line(line)
        return outcome

    @contextmanager
    def reported(self, advice: str, *, moved: bool = False) -> Iterator[None]:
        """What ends a run early goes into its log too; a fault is followed by `advice`, an interruption by its own.

        A refusal says that nothing has moved: after a half of the run (`moved`) it is a fault.
        """
        try:
            yield
        except (RigError, BoardError) as error:
            if isinstance(error, Refused) and not moved:
                self.shown.log(str(error))
                raise
            fault = Fault(error.name, _with_notes(error.what, error), error.remedy)
            self.shown.log(str(fault))
            self.shown.line(advice)
            raise fault from error
        except OSError as error:
            remedy = f"Mend that, then go on with: {resuming(self.folder)}"
            fault = Fault("system", f"{self.folder} cannot be used ({error})", remedy)
            self.shown.log(str(fault))
            raise fault from error
        except KeyboardInterrupt as interrupt:
            stopped = _with_notes("interrupted", interrupt)
            text = f"{stopped}; the data are kept in {self.folder}. Go on with: {resuming(self.folder)}"
            self.shown.log(text)
            raise KeyboardInterrupt(text) from None
        except Exception:
            self.shown.log(traceback.format_exc())
            raise


def agreed(announcement: Sequence[str]) -> bool:
    """The answer where there is nobody to ask."""
    return True


def _with_notes(what: str, error: BaseException) -> str:
    """What happened, and what the arm added on its way out about its stop."""
    return "; ".join([what, *getattr(error, "__notes__", ())])

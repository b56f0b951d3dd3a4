"""Transport to a device in the same process: the simulated scanner without a bus."""

from __future__ import annotations

from drivers.scanner import TransportError
from drivers.scsi.checks import check_command, with_sense
from drivers.scsi.transport import DEFAULT_TIMEOUT_S, Reply, Target

MAX_TRANSFER = 1 << 20  # what an SG_IO host adapter commonly allows


class InProcess:
    """Calls a target directly. Faults of a bus are raised by the target."""

    def __init__(self, target: Target, *, max_transfer: int = MAX_TRANSFER) -> None:
        self.max_transfer = max_transfer
        self._target, self._open = target, True

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """See Transport. Data beyond data_in_length is dropped."""
        if not self._open:
            raise TransportError("the way to the scanner is closed", "open it again")
        check_command(self, cdb, data_out, data_in_length, timeout)
        answer = self._target.execute(cdb, data_out, data_in_length)
        reply = Reply(answer.status, answer.data[:data_in_length], answer.sense)
        return with_sense(self, cdb, reply, timeout)

    def close(self) -> None:
        """Close the transport; the target keeps running."""
        self._open = False

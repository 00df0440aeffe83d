"""What goes wrong, as exceptions."""

from collections.abc import Iterable
from typing import Any

import grpc

from ._wire import PACKAGE, message_class


class ExemplarError(Exception):
    """A call that failed.

    `code` is the stable name that the service gave ("invalid_argument", "not_found", ...), `message` says what is
    wrong with the value and its place, `field` is the request's field at fault as a path
    ("query.objects[0].pose.position"), or "" where none is.
    """

    code = "internal"

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.field = field


class InvalidArgumentError(ExemplarError, ValueError):
    """A value that cannot be meant."""

    code = "invalid_argument"


class NotFoundError(ExemplarError, LookupError):
    """No such trial, skill, version or object."""

    code = "not_found"


class AlreadyExistsError(ExemplarError):
    """It is there already."""

    code = "already_exists"


class FailedPreconditionError(ExemplarError):
    """Refused in the present state, or unsafe: out of reach, in collision."""

    code = "failed_precondition"


class UnavailableError(ExemplarError, ConnectionError):
    """No service answers."""

    code = "unavailable"


class ResourceExhaustedError(ExemplarError):
    """Too large, or too many."""

    code = "resource_exhausted"


class DeadlineExceededError(ExemplarError, TimeoutError):
    """The call took longer than its timeout."""

    code = "deadline_exceeded"


class CancelledError(ExemplarError):
    """The call was cancelled."""

    code = "cancelled"


class DataLossError(ExemplarError):
    """Stored data cannot be read."""

    code = "data_loss"


class InternalError(ExemplarError):
    """A fault of the service."""


class UnauthenticatedError(ExemplarError, PermissionError):
    """No token or certificate was shown, or one that is not known or has expired; `field` says which."""

    code = "unauthenticated"


class PermissionDeniedError(ExemplarError, PermissionError):
    """The caller is known and lacks the role that the call takes; the message names both."""

    code = "permission_denied"


class UnimplementedError(ExemplarError, NotImplementedError):
    """Not served there: the address of another service, or one of another version."""

    code = "unimplemented"


_BY_CODE: dict[str, type[ExemplarError]] = {kind.code: kind for kind in ExemplarError.__subclasses__()}

# What a code of gRPC means that came without our detail: from gRPC itself, or from a server that is not ours.
_WITHOUT_DETAIL: dict[grpc.StatusCode, type[ExemplarError]] = {
    grpc.StatusCode.ABORTED: FailedPreconditionError,
    grpc.StatusCode.OUT_OF_RANGE: InvalidArgumentError,
}


def from_detail(detail: Any, code: grpc.StatusCode = grpc.StatusCode.INTERNAL) -> ExemplarError:
    """The exception for an ErrorDetail. code: counts where a server of another version names one that is not known."""
    return (_BY_CODE.get(detail.code) or _of_status(code))(detail.message, detail.field)


def from_rpc(error: Any, address: str) -> ExemplarError:
    """The exception for what a call of gRPC raised, which has code(), details() and trailing_metadata()."""
    detail = _detail(error.trailing_metadata() or ())
    if detail is not None:
        return from_detail(detail, error.code())
    code = error.code()
    if code == grpc.StatusCode.UNAVAILABLE:
        return UnavailableError(f"no answer from {address}: {error.details()}")
    if code == grpc.StatusCode.DEADLINE_EXCEEDED:
        return DeadlineExceededError(f"{address} did not answer in time")
    if code == grpc.StatusCode.UNIMPLEMENTED:
        return UnimplementedError(f"{address} does not serve this call: {error.details()}")
    if code == grpc.StatusCode.CANCELLED:
        return CancelledError(f"the call to {address} was cancelled")
    return _of_status(code)(f"{address}: {error.details()}")


def _of_status(code: grpc.StatusCode) -> type[ExemplarError]:
    if code in _WITHOUT_DETAIL:
        return _WITHOUT_DETAIL[code]
    return _BY_CODE.get(code.name.lower(), InternalError)


def _detail(metadata: Iterable[tuple[str, Any]]) -> Any:
    for key, value in metadata:
        if key == "grpc-status-details-bin":
            for part in message_class("CallStatus").FromString(value).details:
                if part.type_url.endswith(f"/{PACKAGE}.ErrorDetail"):
                    return message_class("ErrorDetail").FromString(part.value)
    return None

"""The client has a call for everything that the protocol has, and a parameter for each field of its requests."""

import inspect
from collections.abc import Iterator
from importlib import resources
from typing import Any

import pytest
from google.protobuf import descriptor_pb2

import exemplar
from exemplar import _wire

NAMESPACES = ("trials", "skills", "robot", "recorder", "topics", "learning_data", "recorder_data")

# A value for each parameter of the calls by its name, unlike the protocol's default.
POSE = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]
VALUES: dict[str, Any] = {
    "content": "both",
    "count": 2,
    "detached": True,
    "dry_run": True,
    "expect_timeout_s": 2.0,
    "expected_topics": ["ircp/suit"],
    "factor": 0.5,
    "follow": True,
    "joint_start": {"elbow": 0.5},
    "keep_days": 5.0,
    "keep_versions_days": 5.0,
    "last": False,
    "max_rate_hz": 5.0,
    "metadata": {"a": "b"},
    "name": "press",
    "needed_too": True,
    "note": "stuck",
    "objects": {"button": POSE},
    "options": {"method": "paper"},
    "person": "user03",
    "queue": 5,
    "sample": {"a": 1},
    "schema": "struct A { long a; };",
    "skill": "press",
    "speed": 0.5,
    "split_bytes": 5,
    "split_s": 5.0,
    "start": POSE,
    "suit": "anna",
    "topic": "ircp/objects",
    "touch": ["button"],
    "trial": exemplar.Trial(
        end_effectors={"": exemplar.PoseSeries([0.0, 1.0], [[0, 0, 0], [1, 1, 1]])}, source="a.csv"
    ),
    "trial_id": "trial-1",
    "type": "A",
    "version": 2,
    "writer": None,
}
# Of calls with a value of another type.
OTHERS = [("topics", "publish", {"topic": "ircp/objects", "sample": b"cdr"})]


class Recording:
    """A link that keeps what would be sent."""

    def __init__(self, settings: Any) -> None:
        self.settings = settings
        self.sent: dict[str, list[Any]] = {}
        self.questions: Iterator[Any] = iter(())

    def _keep(self, call: Any, _: Any = None) -> None:
        sent = call.requests() if hasattr(call, "requests") else [call.request]
        self.sent.setdefault(call.method.path, []).extend(sent)

    unary = upload = download = long = subscribe = copy = _keep

    def channel(self, method: Any) -> Any:
        """Of a stream of questions, which sends them itself."""
        self.sent.setdefault(method.path, [])
        recording = self

        class Channel:
            def stream_stream(self, path: str, **_: Any) -> Any:
                def begin(requests: Iterator[Any], **_: Any) -> Iterator[Any]:
                    recording.questions = requests
                    return iter(())

                return begin

        return Channel()


@pytest.fixture(scope="module")
def sent() -> dict[str, list[Any]]:
    """By path of the method, what all calls of the client would send."""
    client = exemplar.Client("127.0.0.1:1")
    link = Recording(client._link.settings)
    for name in NAMESPACES:
        namespace = getattr(client, name)
        namespace._link = link
        for method_name, method in inspect.getmembers(namespace, inspect.ismethod):
            if method_name.startswith("_"):
                continue
            if method_name == "restore":  # sends what a backup holds: test_data.py
                link.sent[_wire.method(f"{namespace._service}/Restore").path] = []
                continue
            parameters = inspect.signature(method).parameters.values()
            named = [p for p in parameters if p.name != "timeout" and p.kind is not p.VAR_POSITIONAL]
            words = ["ircp/*"] if any(p.kind is p.VAR_POSITIONAL for p in parameters) else []
            required = {p.name: VALUES[p.name] for p in named if p.default is p.empty}
            method(*words, **required)
            for optional in (p for p in named if p.default is not p.empty):
                method(*words, **required, **{optional.name: VALUES[optional.name]})
    for name, method_name, given in OTHERS:
        getattr(getattr(client, name), method_name)(**given)
    stream = client.skills.query_stream("press", version=2)
    for start, joint_start in ((POSE, None), (None, {"elbow": 0.5})):
        with pytest.raises(exemplar.UnavailableError):
            stream.query({"button": POSE}, start=start, joint_start=joint_start)
    link.sent["/exemplar.v1.SkillService/QueryStream"] = [next(link.questions) for _ in range(2)]
    return link.sent


def methods() -> dict[str, Any]:
    """Of all services, by path."""
    data = resources.files("exemplar").joinpath("api.binpb").read_bytes()
    found = {}
    for file in descriptor_pb2.FileDescriptorSet.FromString(data).file:
        for service in _wire._pool().FindFileByName(file.name).services_by_name.values():
            for method in service.methods:
                found[f"/{service.full_name}/{method.name}"] = method
    return found


def fields(descriptor: Any, place: str = "") -> set[str]:
    """Paths of all fields of a message of ours."""
    paths = set()
    for field in descriptor.fields:
        paths.add(place + field.name)
        inner = field.message_type
        if inner is not None and inner.full_name.startswith(_wire.PACKAGE) and not inner.GetOptions().map_entry:
            paths |= fields(inner, f"{place}{field.name}.")
    return paths


def filled(message: Any, place: str = "") -> set[str]:
    """Paths of the fields that a message has."""
    paths = set()
    for field, value in message.ListFields():
        paths.add(place + field.name)
        if field.message_type is not None and not field.message_type.GetOptions().map_entry:
            for each in [value] if hasattr(value, "ListFields") else value:
                paths |= filled(each, f"{place}{field.name}.")
    return paths


def test_every_method_of_the_protocol_has_a_call(sent: dict[str, list[Any]]) -> None:
    assert set(methods()) == set(sent)


def test_every_field_of_a_request_has_a_parameter(sent: dict[str, list[Any]]) -> None:
    for path, method in methods().items():
        if path.endswith("/Restore"):
            continue
        given: set[str] = set().union(*(filled(message) for message in sent[path]))
        assert fields(method.input_type) - given == set(), path

"""The messages of proto/exemplar/v1, made from the descriptors that the build puts beside this file."""

from functools import cache
from importlib import resources
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

# A message of the protocol; its fields are those of the .proto files.
Message = Any

PACKAGE = "exemplar.v1"


@cache
def _pool() -> Any:
    # A pool of its own: other packages may bring other versions of the same files.
    pool = descriptor_pool.DescriptorPool()
    data = resources.files(__package__).joinpath("api.binpb").read_bytes()
    for file in descriptor_pb2.FileDescriptorSet.FromString(data).file:
        pool.AddSerializedFile(file.SerializeToString())
    return pool


@cache
def _message_class(descriptor: Any) -> Any:
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(descriptor)
    return message_factory.MessageFactory(_pool()).GetPrototype(descriptor)


def message_class(name: str) -> Any:
    """The class of a message, by its name within the package."""
    return _message_class(_pool().FindMessageTypeByName(f"{PACKAGE}.{name}"))


class Method:
    """A method of a service: `Method("TrialService/List")`."""

    def __init__(self, name: str) -> None:
        self.service, _, method = name.partition("/")
        found = _pool().FindServiceByName(f"{PACKAGE}.{self.service}").methods_by_name[method]
        self.path = f"/{PACKAGE}.{name}"
        self.request = _message_class(found.input_type)
        self.response = _message_class(found.output_type)

    def codec(self) -> dict[str, Any]:
        """What a channel of gRPC wants to know of it."""
        return {
            "request_serializer": self.request.SerializeToString,
            "response_deserializer": self.response.FromString,
        }


@cache
def method(name: str) -> Method:
    """Looks a method up once."""
    return Method(name)

"""The messages of enfilade.proto, as classes created at import.

Example: `messages.Hello(protocol_version="1.0.0")`. Values of enums outside messages are attributes
too: `messages.ERROR_VERSION`. protoc generates `messages.desc` from the .proto. A separate pool
avoids clashes with other programs' messages.
"""

from __future__ import annotations

import functools
from importlib import resources
from typing import Any, Dict

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

_pool = descriptor_pool.DescriptorPool()


def _class_of(descriptor: Any) -> type:
    make = getattr(message_factory, "GetMessageClass", None)  # since protobuf 4.22
    if make is None:
        make = message_factory.MessageFactory(_pool).GetPrototype
    made: Any = make(descriptor)
    for nested in descriptor.nested_types:
        setattr(made, nested.name, _class_of(nested))
    return made


def _load() -> Dict[str, Any]:
    found: Dict[str, Any] = {}
    files = descriptor_pb2.FileDescriptorSet()
    files.ParseFromString(resources.files(__package__).joinpath("messages.desc").read_bytes())
    for file in files.file:
        _pool.AddSerializedFile(file.SerializeToString())
        described = _pool.FindFileByName(file.name)
        for name, message in described.message_types_by_name.items():
            found[name] = _class_of(message)
        for enum in described.enum_types_by_name.values():
            found[enum.name] = enum
            found.update((value.name, value.number) for value in enum.values)
    return found


_found = _load()


def __getattr__(name: str) -> Any:
    try:
        return _found[name]
    except KeyError:
        raise AttributeError(f"enfilade.proto has no {name}") from None


@functools.lru_cache(maxsize=256)  # a descriptor takes a microsecond
def word(enum: Any, number: int, prefix: str) -> str:
    """Returns a value's name without its prefix, in lower case: KIND_BEGIN is "begin"."""
    value = enum.values_by_number.get(number)
    return value.name[len(prefix):].lower() if value else str(number)

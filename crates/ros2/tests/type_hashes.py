"""Compares the hashes of types that the node has with those of the definitions.

type_hashes.py
"""

import pathlib
import re
import sys

from definitions import SERVICES, hashes, typestore

SOURCE = pathlib.Path(__file__).parents[1] / "src/transport/zenoh/type_hash.rs"
# Of a service whose hash the design of rmw_zenoh_cpp names.
NAMED = "example_interfaces/AddTwoInts"
NAMED_HASH = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"

SERVICES[NAMED] = ("int64 a\nint64 b\n", "int64 sum\n")
wanted = hashes(typestore())
if wanted.pop(NAMED) != NAMED_HASH:
    sys.exit(f"{NAMED} has another hash than ROS gives it")
rows = re.findall(r'TypeName::new\(\s*"(\w+)",\s*"(\w+)"\s*\),\s*"(\w+)"', SOURCE.read_text())
found = {f"{package}/{name}": value for package, name, value in rows}
if found != wanted or len(rows) != len(wanted):
    differing = {name for name in {*found, *wanted} if found.get(name) != wanted.get(name)}
    sys.exit(f"{SOURCE}: other hashes than those of the definitions: {sorted(differing)}")
print(f"zenoh: the hashes of {len(wanted)} types are right")

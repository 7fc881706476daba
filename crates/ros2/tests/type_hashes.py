"""Compares the type hashes of the node with those computed from the definitions.

type_hashes.py
"""

import pathlib
import re
import sys

from definitions import SERVICES, hashes, typestore

SOURCE = pathlib.Path(__file__).parents[1] / "src/transport/zenoh/type_hash.rs"
# Service whose hash is given in the design of rmw_zenoh_cpp.
NAMED = "example_interfaces/AddTwoInts"
NAMED_HASH = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"

SERVICES[NAMED] = ("int64 a\nint64 b\n", "int64 sum\n")
wanted = hashes(typestore())
if wanted.pop(NAMED) != NAMED_HASH:
    sys.exit(f"the computed hash of {NAMED} differs from that of ROS")
rows = re.findall(r'TypeName::new\(\s*"(\w+)",\s*"(\w+)"\s*\),\s*"(\w+)"', SOURCE.read_text())
found = {f"{package}/{name}": value for package, name, value in rows}
if found != wanted or len(rows) != len(wanted):
    differing = {name for name in {*found, *wanted} if found.get(name) != wanted.get(name)}
    sys.exit(f"{SOURCE}: hashes differ from the definitions: {sorted(differing)}")
print(f"zenoh: the hashes of {len(wanted)} types are correct")

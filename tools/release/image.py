#!/usr/bin/env python3
"""Writes a container image (OCI archive) without a container engine: image.py ARCHIVE VERSION TREE...

TREE is the unpacked archive of one architecture, named voxtile-VERSION-CPU-unknown-linux-musl. The image has one layer
per architecture: the static binaries, licenses, the certificates of certifi (PyPI) for buckets, and an empty /data,
where the command starts. `podman load`, `docker load` (25 or newer) and `skopeo copy oci-archive:ARCHIVE` read it. The
same trees give the same bytes.
"""

import gzip
import hashlib
import io
import json
import os
import pathlib
import sys
import tarfile
import time

import certifi

ARCHITECTURES = {"x86_64": "amd64", "aarch64": "arm64"}
PROGRAMS = ("voxtile", "voxtile-ros2", "voxtile-share")
# An unprivileged user, and group.
USER = 1000


def entry(name, time_s, mode, kind=tarfile.REGTYPE, owner=0):
    header = tarfile.TarInfo(name)
    header.type, header.mtime, header.mode = kind, time_s, mode
    header.uid = header.gid = owner
    return header


def layer(tree, time_s):
    """Returns the tar archive of the files of an image."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        folders = "data etc etc/ssl etc/ssl/certs usr usr/bin usr/share usr/share/doc usr/share/doc/voxtile"
        for folder in folders.split():
            archive.addfile(entry(folder, time_s, 0o755, tarfile.DIRTYPE, USER if folder == "data" else 0))
        archive.addfile(entry("tmp", time_s, 0o1777, tarfile.DIRTYPE))
        files = [tree / "bin" / program for program in PROGRAMS]
        files += (tree / "share/doc/voxtile").glob("*LICENSE*")
        named = {f"usr/{path.relative_to(tree)}": path for path in files}
        named["etc/ssl/certs/ca-certificates.crt"] = pathlib.Path(certifi.where())
        for name, path in sorted(named.items()):
            header = entry(name, time_s, 0o755 if path.parent.name == "bin" else 0o644)
            header.size = path.stat().st_size
            with path.open("rb") as data:
                archive.addfile(header, data)
    return out.getvalue()


class Image:
    """Blobs of an image, each in a file named by its SHA-256."""

    def __init__(self):
        self.blobs = {}

    def add(self, media_type, data):
        """Adds a blob; returns its descriptor."""
        digest = hashlib.sha256(data).hexdigest()
        self.blobs[f"blobs/sha256/{digest}"] = data
        return {"mediaType": media_type, "digest": f"sha256:{digest}", "size": len(data)}

    def add_json(self, media_type, value):
        return self.add(media_type, json.dumps(value, sort_keys=True).encode())

    def add_architecture(self, tree, version, time_s):
        """Adds the image of an architecture; returns the descriptor of its manifest."""
        cpu = tree.name.removeprefix(f"voxtile-{version}-").split("-")[0]
        platform = {"architecture": ARCHITECTURES[cpu], "os": "linux"}
        unpacked = layer(tree, time_s)
        packed = self.add("application/vnd.oci.image.layer.v1.tar+gzip", gzip.compress(unpacked, 9, mtime=0))
        created = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time_s))
        labels = {
            "org.opencontainers.image.title": "voxtile",
            "org.opencontainers.image.version": version,
            "org.opencontainers.image.licenses": "MIT OR Apache-2.0",
        }
        config = {
            **platform,
            "created": created,
            "config": {
                "User": f"{USER}:{USER}",
                "Env": ["PATH=/usr/bin", "HOME=/data"],
                "Entrypoint": ["/usr/bin/voxtile"],
                "WorkingDir": "/data",
                "Labels": labels,
            },
            "rootfs": {"type": "layers", "diff_ids": [f"sha256:{hashlib.sha256(unpacked).hexdigest()}"]},
            "history": [{"created": created, "created_by": f"voxtile {version}"}],
        }
        media_type = "application/vnd.oci.image.manifest.v1+json"
        manifest = {
            "schemaVersion": 2,
            "mediaType": media_type,
            "config": self.add_json("application/vnd.oci.image.config.v1+json", config),
            "layers": [packed],
        }
        return {**self.add_json(media_type, manifest), "platform": platform}

    def write(self, out, version, manifests, time_s):
        """Writes the archive; `manifests` are the descriptors of the architectures."""
        media_type = "application/vnd.oci.image.index.v1+json"
        index = {"schemaVersion": 2, "mediaType": media_type, "manifests": manifests}
        named = {
            **self.add_json(media_type, index),
            "annotations": {
                "io.containerd.image.name": f"localhost/voxtile:{version}",
                "org.opencontainers.image.ref.name": version,
            },
        }
        # One architecture needs no index of architectures, and older programs read none.
        if len(manifests) == 1:
            named = {**manifests[0], "annotations": named["annotations"]}
        files = {
            "index.json": json.dumps({"schemaVersion": 2, "mediaType": media_type, "manifests": [named]}).encode(),
            "oci-layout": json.dumps({"imageLayoutVersion": "1.0.0"}).encode(),
            **self.blobs,
        }
        with tarfile.open(out, mode="w", format=tarfile.USTAR_FORMAT) as archive:
            for folder in ("blobs", "blobs/sha256"):
                archive.addfile(entry(folder, time_s, 0o755, tarfile.DIRTYPE))
            for name, data in sorted(files.items()):
                header = entry(name, time_s, 0o644)
                header.size = len(data)
                archive.addfile(header, io.BytesIO(data))


def main(out, version, *trees):
    time_s = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    image = Image()
    manifests = [image.add_architecture(pathlib.Path(tree), version, time_s) for tree in trees]
    image.write(out, version, manifests, time_s)


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Pushes, reads and pulls a map through slow, failing and interrupted connections: `check.py VOXTILE MAP FOLDER`."""

import http.client
import json
import os
import random
import shutil
import subprocess
import sys
import threading
import time
from functools import partial
from http.server import BaseHTTPRequestHandler, SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import boto3

VOXTILE, MAP, WORK = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
TEMPORARY = WORK / "temporary"
TEMPORARY.mkdir()


class Proxy(BaseHTTPRequestHandler):
    """Forwards requests to the server `behind` and counts what it answers; every third one suffers `fault`."""

    protocol_version = "HTTP/1.1"
    behind = ("127.0.0.1", 0)
    fault = None
    requests = 0
    bytes_answered = 0
    lock = threading.Lock()

    def handle_one(self):
        with Proxy.lock:
            Proxy.requests += 1
            number = Proxy.requests
        length = int(self.headers.get("Content-Length") or 0)
        body = self.rfile.read(length)
        fault = Proxy.fault if number % 3 == 0 else None
        if fault == "slow":
            time.sleep(0.2)
        if fault == "500":
            self.send_response(500)
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        connection = http.client.HTTPConnection(*Proxy.behind, timeout=30)
        connection.request(self.command, self.path, body, dict(self.headers))
        answer = connection.getresponse()
        content = answer.read()
        with Proxy.lock:
            Proxy.bytes_answered += len(content)
        self.send_response(answer.status)
        for name, value in answer.getheaders():
            if name.lower() not in ("connection", "transfer-encoding", "content-length"):
                self.send_header(name, value)
        is_head = self.command == "HEAD"
        self.send_header("Content-Length", answer.getheader("Content-Length") if is_head else str(len(content)))
        self.end_headers()
        if fault == "cut off" and self.command == "GET" and len(content) > 1:
            self.wfile.write(content[: len(content) // 2])
            self.wfile.flush()
            self.connection.close()
            self.close_connection = True
        elif not is_head:
            self.wfile.write(content)

    do_GET = do_PUT = do_POST = do_HEAD = do_DELETE = handle_one

    def log_message(self, *arguments):
        pass


class Files(SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass


def environment(port):
    return {
        **os.environ,
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
        "TMPDIR": str(TEMPORARY),
    }


def voxtile(*arguments, port, fails=False):
    done = subprocess.run(
        [VOXTILE, *map(str, arguments)], env=environment(port), capture_output=True, text=True, timeout=300
    )
    if fails:
        assert done.returncode != 0, f"{arguments} should have failed: {done.stdout}"
        return done.stderr + done.stdout
    assert done.returncode == 0, f"{arguments}: {done.stderr}"
    return done.stdout


def main():
    moto = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        port = next(int(line.rsplit(":", 1)[1]) for line in moto.stdout if "Running on http" in line)
        threading.Thread(target=lambda: [None for _ in moto.stdout], daemon=True).start()
        check(port)
    finally:
        moto.terminate()
        moto.wait()


def check(port):
    s3 = boto3.client(
        "s3",
        endpoint_url=f"http://127.0.0.1:{port}",
        region_name="us-east-1",
        aws_access_key_id="key",
        aws_secret_access_key="secret",
    )
    s3.create_bucket(Bucket="robots")
    url = "s3://robots/maps/city"
    digest = voxtile("digest", MAP, port=port)
    first = json.loads(voxtile("push", MAP, url, "--json", port=port))
    assert first["tiles_sent"] == first["tiles"] > 0, first
    assert json.loads(voxtile("push", MAP, url, "--json", port=port))["objects_sent"] == 0

    # The reading commands print the same for the bucket as for the folder.
    for command in (
        ["digest", "{}"],
        ["query", "{}", 10, 0.5, 0.1],
        ["raycast", "{}", "--origin", 10, 0, 1.5, "--direction", 1, 0.3, 0],
        ["verify", "{}", "--json"],
    ):
        here, there = ([str(word).format(map) for word in command] for map in (MAP, url))
        answers = [voxtile(*words, port=port) for words in (here, there)]
        if "--json" in command:
            answers = [{**json.loads(answer), "map": "", "peak_rss_bytes": 0} for answer in answers]
        assert answers[0] == answers[1], (command, answers)
    for name, map in (("here.ply", MAP), ("there.ply", url)):
        voxtile("export", map, "-o", WORK / name, port=port)
    assert (WORK / "here.ply").read_bytes() == (WORK / "there.ply").read_bytes()
    assert json.loads(voxtile("info", url, "--json", port=port))["tiles"] == first["tiles"]
    print("read from the bucket: digest, query, raycast, verify, export, info")

    # Missing maps and writing commands fail.
    assert "no map here" in voxtile("info", "s3://robots/maps/none", port=port, fails=True)
    assert "is read-only" in voxtile("clear", url, "--region", 0, 0, 0, 1, 1, 1, port=port, fails=True)
    assert "is read-only" in voxtile("crop", MAP, "-o", url, "--region", 0, 0, 0, 9, 9, 9, port=port, fails=True)

    voxtile("pull", url, WORK / "pulled", port=port)
    assert voxtile("digest", WORK / "pulled", port=port) == digest
    voxtile("verify", WORK / "pulled", port=port)

    # Another robot adds to its copy and pushes. The first copy is then behind.
    voxtile("clear", WORK / "pulled", "--region", 0, -3, -3, 8, 3, 3, port=port)
    second = json.loads(voxtile("push", WORK / "pulled", url, "--json", "--prune", port=port))
    assert 0 < second["tiles_sent"] < second["tiles"] and second["objects_pruned"] > 0, second
    assert "flush" in voxtile("push", MAP, url, port=port, fails=True)
    shutil.copytree(MAP, WORK / "behind")
    replaced = json.loads(voxtile("pull", url, WORK / "behind", "--replace", "--json", port=port))
    assert replaced["files_fetched"] < replaced["files"] / 2, replaced
    digest = voxtile("digest", WORK / "behind", port=port)
    assert digest == voxtile("digest", url, port=port) == voxtile("digest", WORK / "pulled", port=port)
    print("changed files pushed and pulled:", replaced["files_fetched"], "of", replaced["files"], "files")

    # A slow, failing and interrupted network.
    Proxy.behind = ("127.0.0.1", port)
    server = ThreadingHTTPServer(("127.0.0.1", 0), Proxy)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    bad = server.server_port
    for fault in ("slow", "500", "cut off"):
        Proxy.fault = fault
        began = time.monotonic()
        assert voxtile("digest", url, port=bad) == digest, fault
        voxtile("push", WORK / "behind", f"{url}-{fault.replace(' ', '-')}", port=bad)
        Proxy.fault = None
        assert voxtile("digest", f"{url}-{fault.replace(' ', '-')}", port=port) == digest, fault
        print(f"{fault}: {time.monotonic() - began:.1f} s")
    # A plain web server offers a copy of the objects for reading.
    pages = s3.get_paginator("list_objects_v2").paginate(Bucket="robots", Prefix="maps/city/")
    keys = [found["Key"] for page in pages for found in page["Contents"]]
    for key in keys:
        (WORK / "web" / key).parent.mkdir(parents=True, exist_ok=True)
        s3.download_file("robots", key, str(WORK / "web" / key))
    files = ThreadingHTTPServer(("127.0.0.1", 0), partial(Files, directory=WORK / "web"))
    threading.Thread(target=files.serve_forever, daemon=True).start()
    web = f"http://127.0.0.1:{files.server_port}/maps/city"
    assert voxtile("digest", web, port=port) == digest
    assert "cannot be written to" in voxtile("push", MAP, web, port=port, fails=True)

    # Errors name objects that are changed, truncated or missing.
    name = next(key for key in keys if "/objects/" in key)
    for content in (b"other", b"", None):
        if content is None:
            s3.delete_object(Bucket="robots", Key=name)
        else:
            s3.put_object(Bucket="robots", Key=name, Body=content)
        output = voxtile("pull", url, WORK / "broken", port=port, fails=True)
        assert name in output, output
        shutil.rmtree(WORK / "broken.unfinished", ignore_errors=True)
    assert "push --resend" in output, output
    print("objects that were changed, truncated or missing are named")
    voxtile("push", WORK / "pulled", url, "--resend", port=port)
    assert voxtile("digest", url, port=port) == digest
    voxtile("verify", url, port=port)
    print("damaged objects sent again with --resend")

    check_scans(s3, port, bad)


def check_scans(s3, port, bad):
    """Scans in a bucket give the same map as scans in a folder."""
    drive, chance = WORK / "web" / "drive", random.Random(3)
    (drive / "scans").mkdir(parents=True)
    for number in range(20):
        points = "\n".join(" ".join(f"{chance.gauss(0, 3):.3f}" for _ in range(3)) for _ in range(200))
        head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 200\nHEIGHT 1\nPOINTS 200\nDATA ascii\n"
        (drive / "scans" / f"{number}.pcd").write_text(head + points + "\n")
    (drive / "poses_kitti.txt").write_text("".join(f"1 0 0 {number} 0 1 0 0 0 0 1 1\n" for number in range(20)))
    for file in drive.rglob("*.*"):
        s3.upload_file(str(file), "robots", f"{file.relative_to(WORK / 'web')}")
    s3.put_object(Bucket="robots", Key="drive/scans/", Body=b"")
    options = ["--resolution", 0.5, "--keep-scans"]
    voxtile("build", drive, "-o", WORK / "of_folder", *options, port=port)
    digest = voxtile("digest", WORK / "of_folder", port=port)
    for number, (fault, through) in enumerate([(None, port), ("500", bad), ("cut off", bad)]):
        Proxy.fault = fault
        built = WORK / f"of_bucket_{number}"
        voxtile("build", "s3://robots/drive", "-o", built, *options, port=through)
        Proxy.fault = None
        assert voxtile("digest", built, port=port) == digest, fault
        # The folder and the bucket count as the same input.
        assert "resum" in voxtile("build", drive, "-o", built, "--resume", "--json", port=port), fault
    listing = json.loads(voxtile("scans", "s3://robots/drive/", "--json", port=port).splitlines()[-1])
    assert listing["scans"] == 20, listing
    web = ThreadingHTTPServer(("127.0.0.1", 0), partial(Files, directory=WORK / "web"))
    threading.Thread(target=web.serve_forever, daemon=True).start()
    one = f"http://127.0.0.1:{web.server_port}/drive/scans/7.pcd"
    voxtile("build", one, "-o", WORK / "one_there", "--resolution", 0.5, "--poses", "identity", port=port)
    voxtile("build", drive / "scans" / "7.pcd", "-o", WORK / "one", "--resolution", 0.5, "--poses", "identity", port=port)
    assert voxtile("digest", WORK / "one_there", port=port) == voxtile("digest", WORK / "one", port=port)
    output = voxtile("build", "s3://robots/nowhere", "-o", WORK / "none", "--resolution", 0.5, port=port, fails=True)
    assert "s3://robots/nowhere: there is nothing" in output, output
    assert not list(TEMPORARY.glob("voxtile-scans-*")), "fetched files are left behind"

    # Kept scans are readable from the bucket.
    voxtile("push", WORK / "of_folder", "s3://robots/kept", port=port)
    listed = [voxtile("scans", map, port=port) for map in (WORK / "of_folder", "s3://robots/kept")]
    assert listed[0].splitlines()[1:] == listed[1].splitlines()[1:], listed
    voxtile("build", "s3://robots/kept", "-o", WORK / "again", "--resolution", 0.5, port=port)
    assert voxtile("digest", WORK / "again", port=port) == digest

    check_kept_scans(s3, port, bad)

    # A comparison reads maps and positions of kept scans from the bucket.
    compared = [
        json.loads(voxtile("compare", map, WORK / "one", "--json", port=port))
        for map in (WORK / "of_folder", "s3://robots/kept")
    ]
    assert compared[0]["after"]["hidden"] is not None and compared[0]["before"]["occupied"] > 0, compared[0]
    for key in ("before", "after", "changes"):
        assert compared[0][key] == compared[1][key], compared

    # The error names the missing keys.
    lacking = {name: value for name, value in environment(port).items() if not name.startswith("AWS_")}
    done = subprocess.run([VOXTILE, "info", "s3://robots/kept"], env=lacking, capture_output=True, text=True, timeout=300)
    assert done.returncode != 0 and "AWS_ACCESS_KEY_ID" in done.stderr, done.stderr
    print("scans in a bucket give the same map as scans in a folder")


def check_kept_scans(s3, port, counting):
    """Kept scans are read from the bucket `robots/kept`, a push of `of_folder`, without a copy of the archive."""
    url, folder = "s3://robots/kept", WORK / "of_folder"
    digests = [voxtile("digest", "--scans", map, port=port) for map in (folder, url)]
    assert digests[0] == digests[1], digests
    poses = WORK / "moved_kitti.txt"
    poses.write_text("".join(f"1 0 0 {number} 0 1 0 {number / 10} 0 0 1 1\n" for number in range(20)))
    segments = sum(file.stat().st_size for file in (folder / "kept_scans").iterdir())
    Proxy.bytes_answered = 0
    voxtile("remap", url, "--poses", poses, "-o", WORK / "remapped", "--keep-scans", port=counting)
    # Manifest, log and metadata are small.
    assert Proxy.bytes_answered < segments + 50_000, (Proxy.bytes_answered, segments)
    output = voxtile("remap", url, "--poses", poses, port=port, fails=True)
    assert "-o" in output and "voxtile pull" in output, output
    voxtile("export", url, "--scans", WORK / "exported", port=port)
    voxtile("build", WORK / "exported", "-o", WORK / "of_exported", "--resolution", 0.5, port=port)
    assert voxtile("digest", WORK / "of_exported", port=port) == voxtile("digest", url, port=port)

    # In place, in a copy: the same map. A push sends the new catalog, but no points.
    shutil.copytree(folder, WORK / "copy")
    voxtile("remap", WORK / "copy", "--poses", poses, port=port)
    for what in ([], ["--scans"]):
        copies = [voxtile("digest", *what, WORK / map, port=port) for map in ("copy", "remapped")]
        assert copies[0] == copies[1], (what, copies)
    pushed = json.loads(voxtile("push", WORK / "copy", url, "--json", "--prune", port=port))
    tiles = sum(file.stat().st_size for file in (WORK / "copy").glob("tile_*/*"))
    assert pushed["bytes_sent"] < tiles + 50_000 and pushed["objects_pruned"] > 0, pushed
    assert voxtile("digest", "--scans", url, port=port) == voxtile("digest", "--scans", WORK / "copy", port=port)

    # Lost and changed objects of scans are named, and sent again.
    manifest = json.loads(s3.get_object(Bucket="robots", Key="kept/manifest.json")["Body"].read())
    for path, file in manifest["files"].items():
        if not path.startswith("kept_scans/"):
            continue
        name = file["parts"][0]
        for content in (b"other", None):
            if content is None:
                s3.delete_object(Bucket="robots", Key=f"kept/objects/{name}")
            else:
                s3.put_object(Bucket="robots", Key=f"kept/objects/{name}", Body=content)
            for command in (["digest", "--scans", url], ["verify", url], ["remap", url, "-o", WORK / "lost"]):
                output = voxtile(*command, port=port, fails=True)
                assert name in output and "push --resend" in output, (command, output)
            voxtile("push", WORK / "copy", url, "--resend", port=port)
            assert "intact" in voxtile("verify", url, port=port)
    # The first state again, for the next checks.
    voxtile("remap", WORK / "copy", "--poses", WORK / "web" / "drive" / "poses_kitti.txt", port=port)
    voxtile("push", WORK / "copy", url, port=port)
    assert voxtile("digest", url, port=port) == voxtile("digest", folder, port=port)
    print("kept scans are read from the bucket, and new poses make a new map")


main()

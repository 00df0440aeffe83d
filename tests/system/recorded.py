"""What recordings hold."""

import json
import subprocess

import processes


def messages(file):
    """Number, source time and bytes of each topic's messages, in order, as the conformance program reads them."""
    return {topic: [row[:2] + row[3:] for row in rows] for topic, rows in stamped(file).items()}


def stamped(file):
    """Number, source time, time of reception and bytes of each topic's messages, likewise."""
    read = subprocess.run([processes.BINARIES / "mcap_conformance", "read", file], check=True, stdout=subprocess.PIPE)
    channels, by_topic = {}, {}
    for record in json.loads(read.stdout)["records"]:
        fields = dict(record["fields"])
        if record["type"] == "Channel":
            channels[fields["id"]] = fields["topic"]
        elif record["type"] == "Message":
            row = (int(fields["sequence"]), fields["publish_time"], fields["log_time"], fields["data"])
            by_topic.setdefault(channels[fields["channel_id"]], []).append(row)
    return by_topic

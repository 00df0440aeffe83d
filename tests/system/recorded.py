"""What recordings hold."""

import json
import subprocess

import processes


def messages(file):
    """Number, source time and bytes of each topic's messages, in order, as the conformance program reads them."""
    read = subprocess.run([processes.BINARIES / "mcap_conformance", "read", file], check=True, stdout=subprocess.PIPE)
    channels, by_topic = {}, {}
    for record in json.loads(read.stdout)["records"]:
        fields = dict(record["fields"])
        if record["type"] == "Channel":
            channels[fields["id"]] = fields["topic"]
        elif record["type"] == "Message":
            by_topic.setdefault(channels[fields["channel_id"]], []).append(
                (int(fields["sequence"]), fields["publish_time"], fields["data"]))
    return by_topic

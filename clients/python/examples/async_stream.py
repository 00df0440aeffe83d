"""Asks a skill again and again while its object moves, and learns its next version beside that.

Usage: python async_stream.py press target [--server HOST:PORT]
"""

import argparse
import asyncio
import math
from collections.abc import AsyncIterator

import numpy as np

import exemplar
from exemplar import AsyncClient, Pose


async def seen(middle: Pose, steps: int) -> AsyncIterator[Pose]:
    """Stands for a camera: the object goes round on a circle of 2 cm."""
    for step in range(steps):
        angle = 2 * math.pi * step / steps
        yield Pose(middle.position + 0.02 * np.array([math.cos(angle), math.sin(angle), 0]), middle.quaternion)
        await asyncio.sleep(0.01)


async def follow(client: AsyncClient, skill: str, target: str, steps: int) -> None:
    report = await client.skills.get(skill)
    middle = report.trials[0].target
    assert middle is not None
    async with client.skills.query_stream(skill) as stream:
        async for pose in seen(middle, steps):
            motion = await stream.query({target: pose})
            print(f"{target} at {pose.position.round(3)}: {motion.duration_s:.2f} s, {len(motion)} frames")


async def learn(client: AsyncClient, skill: str) -> None:
    learning = client.skills.learn(skill)
    async for progress in learning:
        print(f"learning: {100 * progress.fraction:.0f} % {progress.step}")
    print(f"version {(await learning.result()).version}")


async def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("skill")
    parser.add_argument("target", help="name of the object")
    parser.add_argument("--server", help="HOST:PORT (default: EXEMPLAR_SERVER)")
    parser.add_argument("--steps", type=int, default=50)
    arguments = parser.parse_args()
    async with exemplar.AsyncClient(arguments.server) as client:
        # Queries never wait for learning.
        await asyncio.gather(
            follow(client, arguments.skill, arguments.target, arguments.steps), learn(client, arguments.skill)
        )


if __name__ == "__main__":
    asyncio.run(main())

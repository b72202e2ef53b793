"""A language model that streams: the face speaks the first sentence while the model writes the second.

  realizer serve
  python examples/streaming_model.py ws://127.0.0.1:8765/ws?session=chat

dialogue.py beside this file is the whole of a dialogue: marks in the text, and users who interrupt.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator

from bml_schema.feedback import SyncPointProgress
from realizer.client import connect

TEXT = "Streams are quick. <sync id='point'/>This sentence is written while the first is spoken."


async def model() -> AsyncIterator[str]:
    """Yield tokens, as a language model does; replace it by yours."""
    for token in TEXT.split(" "):
        yield token + " "
        await asyncio.sleep(0)


async def main(address: str) -> None:
    # A behaviour may refer to a point of the text before the model has written it.
    nod = '<bml id="nods"><head id="nod" lexeme="NOD" stroke="turn:turn:point"/></bml>'
    async with connect(address) as client:
        async with client.speech("turn") as speech:
            async for token in model():
                await speech.append(token)
                if token == "Streams ":
                    await client.send(nod)
        end = await speech.ended()
        print(f"ended at {end.global_time:.2f} s")
        async for feedback in client.until_end("nods"):
            if isinstance(feedback, SyncPointProgress) and feedback.id == "nods:nod:stroke":
                print(f"nodded at {feedback.global_time:.2f} s")


if __name__ == "__main__":
    if len(sys.argv) <= 1:
        sys.exit(__doc__)
    try:
        asyncio.run(main(sys.argv[1]))
    except OSError as error:  # such as no service
        sys.exit(str(error))

"""Files that somebody has spoilt: lines changed, dropped, doubled or exchanged."""

import random

JUNK = ["nan", "inf", "-1", "0", "1e99", '"x"', "[]", "true", "[1.0, 2.0]", "{}", "1e-9", "[["]


def mutated(text: str, seed: int) -> str:
    """Return a TOML file with one to four mutations of its lines; comments stay."""
    rng = random.Random(seed)
    lines = text.splitlines()
    for _ in range(rng.randint(1, 4)):
        own = [k for k, line in enumerate(lines) if line and not line.startswith("#")]
        if not own:
            break
        k = rng.choice(own)
        way = rng.randrange(5)
        if way == 0:
            del lines[k]
        elif way == 1:
            lines.insert(k, lines[k])
        elif way == 2 and "=" in lines[k]:
            lines[k] = f"{lines[k].partition('=')[0]}= {rng.choice(JUNK)}"
        elif way == 3:
            place = rng.randrange(len(lines[k]))
            lines[k] = lines[k][:place] + chr(rng.randrange(32, 127)) + lines[k][place + 1 :]
        else:
            other = rng.choice(own)
            lines[k], lines[other] = lines[other], lines[k]
    return "\n".join(lines)

"""Seeded damage to texts and bytes: what editors, disks and people do to files."""

import re

HOSTILE = (
    "nan", "inf", "-inf", "1e999", "-1", "0", "1e-300", "1e300", "9" * 5000, "true", '""', '"a"',
    "[]", "[[]]", "{}", "1979-05-27", '"$x^$"', '"\\u001b[31m"', '"=1+1"', '"/proc/self/environ"',
    '"' + "x" * 5000 + '"', "[1, [2, [3]]]", "0x10", "'../../etc/passwd'", '"\\u0000"', "1e6",
    "[" * 60 + "]" * 60, '"é\\u202e"', "-0.0", "99999999999999999999",
)  # fmt: skip


def bytes_damaged(data, rng):
    """Flip bits, cut, double, zero or insert bytes."""
    data = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        if not data:
            break
        offset = int(rng.integers(len(data)))
        length = int(2 ** rng.uniform(0, 10))
        match rng.integers(6):
            case 0:
                data[offset] ^= 1 << int(rng.integers(8))
            case 1:
                del data[offset:]
            case 2:
                del data[offset : offset + length]
            case 3:
                data[offset:offset] = data[offset : offset + length]
            case 4:
                data[offset : offset + length] = bytes(len(data[offset : offset + length]))
            case 5:
                data[offset:offset] = rng.bytes(length)
    return bytes(data)


def text_damaged(text, rng):
    """Change values, keys and lines of a text with keys and values."""
    lines = text.splitlines()
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        match rng.integers(8):
            case 0 | 1 | 2:
                found = list(re.finditer(r"-?\d[\d.eE+-]*|\"[^\"]*\"|true|false", lines[at]))
                if found:
                    one = found[int(rng.integers(len(found)))]
                    value = HOSTILE[int(rng.integers(len(HOSTILE)))]
                    lines[at] = lines[at][: one.start()] + value + lines[at][one.end() :]
            case 3:
                del lines[at]
                lines = lines or [""]
            case 4:
                lines.insert(at, lines[int(rng.integers(len(lines)))])
            case 5:
                lines[at] = lines[at].replace("=", rng.choice(["", "==", ".x =", "\t= ="]), 1)
            case 6:
                other = int(rng.integers(len(lines)))
                lines[at], lines[other] = lines[other], lines[at]
            case 7:
                column = int(rng.integers(len(lines[at]) + 1))
                lines[at] = (
                    lines[at][:column]
                    + str(rng.choice(list("[]{}\"'#,=\x00\x1b\n")))
                    + (lines[at][column:])
                )
    return "\n".join(lines) + "\n"

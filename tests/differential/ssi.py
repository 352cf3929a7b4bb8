"""SSI words as TWK's description of the system, and 5.5 of the SAA manual, print them: what a master samples, and what it may take
from it. Written from the documents; nothing here comes from axlecast's code. A transfer is a text of 0 and 1 in the order of the clock."""

import dataclasses

TREE = (12, 13)  # multi-turn and single-turn bits of the standard data word


def gray(value):
    return value ^ value >> 1


def binary(code):
    """The inverse of gray: each bit is the parity of the code's bits from the top down to it."""
    value = 0
    for place in reversed(range(code.bit_length())):
        value |= ((code >> place & 1) ^ (value >> (place + 1) & 1)) << place
    return value


@dataclasses.dataclass
class Encoder:
    """One encoder's word: where its bits are, and what follows it."""

    bits: int
    turn_bits: int = 0
    gray: bool = False
    separate: bool = False  # a Gray code for each of turns and position, and not one for both
    tree: bool = False
    first_bit: int = 1  # from 1
    word_bits: int = 0
    status: dict = dataclasses.field(default_factory=dict)  # name: (bit, level at which it is active)
    parity: tuple = ()  # ("even" or "odd", bit)
    repeat: str = "none"  # the word is sent again: one_zero between, no_gap
    words: int = 2
    trailing: str = "unchecked"  # behind the last word: zero, repeat

    def __post_init__(self):
        if self.tree:
            self.first_bit, self.word_bits = 1 + TREE[0] - self.turn_bits, sum(TREE)
        ends = [self.first_bit + self.turn_bits + self.bits - 1, *(bit for bit, _ in self.status.values()), *self.parity[1:]]
        self.word_bits = max(self.word_bits, *ends)

    def settings(self):
        """In the words of docs/decode.md."""
        found = [f"bits={self.bits}", f"turn_bits={self.turn_bits}", f"gray={str(self.gray).lower()}",
                 f"halves={'separate' if self.separate else 'joint'}", f"repeat={self.repeat}", f"trailing={self.trailing}"]
        found += ["format=tree25"] if self.tree else [f"first_bit={self.first_bit}", f"word_bits={self.word_bits}"]
        found += [f"status={name}:{bit}{'' if level else ':low'}" for name, (bit, level) in self.status.items()]
        found += [f"parity={self.parity[0]}:{self.parity[1]}"] if self.parity else []
        return found + ([f"words={self.words}"] if self.repeat != "none" else [])

    def position_text(self, counts, turns):
        if not self.gray:
            return f"{turns << self.bits | counts:0{self.turn_bits + self.bits}b}"
        if not self.separate:
            return f"{gray(turns << self.bits | counts):0{self.turn_bits + self.bits}b}"
        return (f"{gray(turns):0{self.turn_bits}b}" if self.turn_bits else "") + f"{gray(counts):0{self.bits}b}"

    def word(self, counts, turns=0, active=()):
        """The bits of a word from 1 on; all others are 0."""
        word = ["0"] * self.word_bits
        begin = self.first_bit - 1
        word[begin:begin + self.turn_bits + self.bits] = self.position_text(counts, turns)
        for name, (bit, level) in self.status.items():
            word[bit - 1] = str(int((name in active) == bool(level)))
        if self.parity and word.count("1") % 2 != (self.parity[0] == "odd"):
            word[self.parity[1] - 1] = "1"
        return "".join(word)

    def transfer(self, word, after=0):
        """The idle level, which the first clock samples, the word as often as it is sent, and `after` further samples."""
        gap = "" if self.repeat == "no_gap" else "0"
        times = 1 if self.repeat == "none" else self.words
        return "1" + gap.join([word] * times) + self.following(word, after)

    def following(self, word, size):
        """So many samples behind the last word: zeros, or the word again as TWK's 4 prints it (one zero, then the most significant bit) or,
        with no_gap, as the SAA manual does."""
        again = word if self.repeat == "no_gap" else "0" + word
        return (("0" if self.trailing == "zero" else again) * size)[:size]

    def read(self, samples):
        """(counts, turns, names of active status bits) of a transfer; None: it must be refused."""
        size = self.word_bits
        if len(samples) == size:
            return self._content(samples)  # the word alone, as documents print it
        if "0" not in samples:
            return None  # a line without an encoder
        times, gap = (1, 0) if self.repeat == "none" else (self.words, int(self.repeat == "one_zero"))
        end = 1 + times * size + (times - 1) * gap
        if len(samples) < end or samples[0] != "1":
            return None
        word = samples[1:1 + size]
        for place in range(times):
            begin = 1 + place * (size + gap)
            if samples[begin:begin + size] != word or (place and gap and samples[begin - 1] != "0"):
                return None
        if self.trailing != "unchecked" and samples[end:] != self.following(word, len(samples) - end):
            return None
        return self._content(word)

    def _content(self, word):
        if self.parity and word.count("1") % 2 != (self.parity[0] == "odd"):
            return None
        begin, middle = self.first_bit - 1, self.first_bit - 1 + self.turn_bits
        used = set(range(begin, middle + self.bits)) | {bit - 1 for bit, _ in self.status.values()} | {bit - 1 for bit in self.parity[1:]}
        if self.tree and any(bit == "1" for place, bit in enumerate(word) if place not in used):
            return None
        turns, counts = int(word[begin:middle] or "0", 2), int(word[middle:middle + self.bits], 2)
        if self.gray and self.separate:
            turns, counts = binary(turns), binary(counts)
        elif self.gray:
            both = binary(turns << self.bits | counts)
            turns, counts = both >> self.bits, both % 2**self.bits
        active = {name for name, (bit, level) in self.status.items() if word[bit - 1] == str(int(bool(level)))}
        return counts, turns, active

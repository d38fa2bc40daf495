"""What a recording is refused with."""


def one_line(text):
    """The text with question marks for characters that are not to be printed, as names in damaged files have."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


class RecordingError(ValueError):
    """A recording, a topic or an option that cannot be used: one line with the file, the topic, what was found and expected."""

    def __init__(self, text):
        super().__init__(one_line(text))


def refusal(*places_and_text):
    """RecordingError "file: topic: text" of its parts; empty ones are left out."""
    return RecordingError(": ".join(str(part) for part in places_and_text if part))

"""What a recording is refused with."""


class RecordingError(ValueError):
    """A recording, a topic or an option that cannot be used: one line with the file, the topic, what was found and expected."""


def refusal(*places_and_text):
    """RecordingError "file: topic: text" of its parts; empty ones are left out."""
    return RecordingError(": ".join(str(part) for part in places_and_text if part))

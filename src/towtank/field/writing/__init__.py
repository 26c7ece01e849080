"""Records written in the formats that craft write, so that they can be read back; those made up are marked."""

from towtank.field.writing.offer import FORMATS as FORMATS
from towtank.field.writing.offer import write_as as write_as

"""The old place of `numbers.double_double.Multiples`, until the modules in run that use it move."""

from heavytop.numbers.double_double import Multiples as Multiples

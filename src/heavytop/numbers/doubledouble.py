"""The old name of `numbers.double_double`, until the last module that uses it has moved."""

from heavytop.numbers.double_double import two_product as two_product

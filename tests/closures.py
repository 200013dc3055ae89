"""Closures of any type, made of what the types together take."""

from modalprep.multibody import Closure


def closure_of(*, type, **given):
    """Return a closure of a type without the keys that belong to others."""
    others = {
        key for rule in Closure.applies if rule.needs == ("type",) and type not in rule.among for key in rule.keys
    }
    return Closure(type=type, **{key: value for key, value in given.items() if key not in others})

"""Signatures of records: of a field ``given(converter=..., default=x)`` they show the default x."""

import griffe


class Given(griffe.Extension):
    """Put the default of a field in the place of the call that describes it."""

    def on_attribute_instance(self, *, attr, **_):
        """Look at one field."""
        call = attr.value
        if not isinstance(call, griffe.ExprCall) or call.canonical_path != "modalprep.records.given":
            return
        found = {argument.name: argument.value for argument in call.arguments}
        made = found.get("default_factory")
        attr.value = made.body if isinstance(made, griffe.ExprLambda) else made or found.get("default")

"""JSON Schema of specs, for editors: made from the fields that the spec's values declare."""

from typing import Any

from rigid.spec.values import SpecBody

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a spec's file."""
    made = SpecBody.model_json_schema()
    return {"$schema": DIALECT, **made, "title": "Spec of rigid"}

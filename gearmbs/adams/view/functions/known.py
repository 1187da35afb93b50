"""All functions of View's design-time expressions by their names."""

from gearmbs.adams.view.functions import matrices, numeric, objects, places, texts

FUNCTIONS = {
    name: function for part in (matrices, numeric, objects, places, texts) for name, function in part.FUNCTIONS.items()
}

"""The dashboards of packaging/grafana, and their queries."""
import json
from pathlib import Path

from grafana import Dashboard

FOLDER = Path(__file__).resolve().parents[2] / "packaging" / "grafana"
DASHBOARDS = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.json"))}
SOURCE_TYPE = "grafana-postgresql-datasource"


def targets(dashboard):
    """(where, kind of panel, query) of each query that a dashboard sends, but for variables."""
    for panel in dashboard["panels"]:
        for query in panel["targets"]:
            yield f"{panel['title']} {query['refId']}", panel["type"], query
    for annotation in dashboard["annotations"]["list"]:
        yield f"annotation {annotation['name']}", "annotation", annotation["target"]


def opened(dashboard, sql, source, start, end, interval_ms):
    """Returns the state of a dashboard as after opening it: of a variable for one value the first, of one for several all. `sql` runs a query."""
    state = Dashboard({"source": source}, start, end, interval_ms)
    for variable in dashboard["templating"]["list"]:
        if variable["type"] == "query":
            values = [row[0] for row in sql(state.query(variable["query"]))]
            if not values:
                raise AssertionError(f"the variable {variable['name']} has no value: {state.query(variable['query'])}")
            state.variables[variable["name"]] = values if variable["multi"] else values[0]
    return state

"""What Grafana makes of the text of a query before it sends it to PostgreSQL: variables first (in the browser), then the global values, then
the macros of the PostgreSQL data source. After Grafana's documentation: "Variable syntax", "PostgreSQL query editor" and "PostgreSQL template
variables", and the source of Grafana where the documentation is silent: a macro is $NAME(ARGUMENTS) without a closing bracket in them, its
arguments are separated by commas, and an unknown macro is an error."""
import datetime
import re

VARIABLE = re.compile(r"\$(\w+)|\$\{(\w+)(?::(\w+))?\}")
MACRO = re.compile(r"\$([_a-zA-Z0-9]+)\(([^)]*)\)")
DURATION_MS = {"ms": 1, "s": 1000, "m": 60_000, "h": 3_600_000, "d": 86_400_000}


class GrafanaError(Exception):
    pass


def quoted(value):
    return "'" + value.replace("'", "''") + "'"


def formatted(value, style):
    """A value is a text, or a list of texts: several selected values of a variable that permits it."""
    values = value if isinstance(value, list) else [value]
    if style in ("sqlstring", "singlequote"):
        return ",".join(quoted(one) for one in values)
    if style == "csv":
        return ",".join(values)
    if style == "raw":
        return value if isinstance(value, str) else ",".join(value)
    if style is not None:
        raise GrafanaError(f"format {style} is not written down here")
    return ",".join(quoted(one) for one in values) if isinstance(value, list) else value.replace("'", "''")


def duration_text(interval_ms):
    """As Grafana writes $__interval: in the largest unit that is whole."""
    return next(f"{interval_ms // unit}{name}" for name, unit in reversed(DURATION_MS.items()) if interval_ms % unit == 0)


class Dashboard:
    """The state of a dashboard: values of its variables, its time range, and the interval of a point on the screen."""

    def __init__(self, variables, start, end, interval_ms):
        self.variables = {**variables, "__interval": duration_text(interval_ms), "__interval_ms": str(interval_ms),
                          "__from": str(int(start.timestamp() * 1000)), "__to": str(int(end.timestamp() * 1000))}
        self.start, self.end = start, end

    def query(self, text):
        """The text that PostgreSQL receives."""
        return MACRO.sub(self._macro, VARIABLE.sub(self._variable, text))

    def _variable(self, match):
        name = match[1] or match[2]
        # What is no variable of the dashboard stays as it is: a macro, or $1.
        return formatted(self.variables[name], match[3]) if name in self.variables else match[0]

    def _macro(self, match):
        name, arguments = match[1], [argument.strip(" ") for argument in match[2].split(",")]
        start, end = (quoted(time.astimezone(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%S.%fZ")) for time in (self.start, self.end))
        seconds = int(self.start.timestamp()), int(self.end.timestamp())
        if name == "__timeFilter":
            return f"{arguments[0]} BETWEEN {start} AND {end}"
        if name in ("__timeGroup", "__timeGroupAlias"):
            size = self._seconds(arguments[1].strip("'"))
            return f"floor(extract(epoch from {arguments[0]})/{size})*{size}" + (' AS "time"' if name.endswith("Alias") else "")
        simple = {"__timeFrom": start, "__timeTo": end, "__unixEpochFrom": str(seconds[0]), "__unixEpochTo": str(seconds[1]),
                  "__time": f'{arguments[0]} AS "time"',
                  "__unixEpochFilter": f"{arguments[0]} >= {seconds[0]} AND {arguments[0]} <= {seconds[1]}"}
        if name not in simple:
            raise GrafanaError(f"unknown macro ${name}")
        return simple[name]

    @staticmethod
    def _seconds(text):
        match = re.fullmatch(r"(\d+)(ms|s|m|h|d)", text)
        if not match:
            raise GrafanaError(f"{text} is no interval")
        return int(match[1]) * DURATION_MS[match[2]] / 1000

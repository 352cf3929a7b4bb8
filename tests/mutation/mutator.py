"""Finds the mutants of a C++ source by libclang, and writes the source with all of them in it, each chosen by its number at
run time (schema.h)."""

import dataclasses
import re

from clang import cindex
from clang.cindex import CursorKind as K
from clang.cindex import TypeKind as T

S = "axlecast_mutation::"
COMPARISONS = {"<": ("Less", "<=", ">="), "<=": ("LessEqual", "<", ">"), ">": ("Greater", ">=", "<="), ">=": ("GreaterEqual", ">", "<")}
ARITHMETIC = {"+": ("Plus", "-"), "-": ("Minus", "+"), "*": ("Times", "+"), "/": ("Over", "*"), "%": ("Modulo", "/"),
              "<<": ("ShiftLeft", ">>"), ">>": ("ShiftRight", "<<"), "&": ("BitAnd", "|"), "|": ("BitOr", "&"), "^": ("BitXor", "|")}
ASSIGNMENTS = {"+=": ("AddTo", "-="), "-=": ("TakeFrom", "+="), "|=": ("OrInto", "&="), "&=": ("AndInto", "|="), "^=": ("XorInto", "|=")}
NUMBERS = {T.BOOL, T.CHAR_U, T.UCHAR, T.CHAR_S, T.SCHAR, T.SHORT, T.USHORT, T.INT, T.UINT, T.LONG, T.ULONG, T.LONGLONG, T.ULONGLONG,
           T.FLOAT, T.DOUBLE}
FUNCTIONS = {K.FUNCTION_DECL, K.CXX_METHOD, K.CONSTRUCTOR, K.DESTRUCTOR, K.CONVERSION_FUNCTION, K.FUNCTION_TEMPLATE}
# A statement without which nothing changes that a test may observe: what is logged, and the room that a container reserves.
NOT_DROPPED = re.compile(r"(\.|->)(reserve|shrink_to_fit)\(|^\W*(\w+(\.|->))*(log_?|Log)\(|^\W*spdlog::|^\W*assert\(")
# The values that `return {}` would return, too.
DEFAULTS = re.compile(r"(\{\}|std::nullopt|nullptr|false|0|\"\"|std::\w+\{\})$")


@dataclasses.dataclass
class Site:
    """A place in the source that is rewritten: `write` gets the rendered holes and the numbers of the mutants."""
    start: int
    end: int
    rank: int  # of sites with the same range: a lower one is further outside
    holes: list
    mutants: list  # (what it was, what it becomes)
    write: object
    function: str = ""
    constant: bool = False  # in a function that the compiler may execute
    numbers: list = dataclasses.field(default_factory=list)


def text_key(text):
    return re.sub(r"\s+", " ", re.sub(r"//[^\n]*", "", text)).strip()


def shortened(text, limit=100):
    text = text_key(text)
    return text if len(text) <= limit else text[:limit - 20] + " … " + text[-17:]


class Finder:
    """Collects the sites of one source."""

    def __init__(self, path, arguments, source):
        self.path, self.source, self.sites = str(path), source, []
        self.last_jumps = set()  # the breaks at the end of a switch, which end it anyway
        self.bytes = source.encode()
        unit = cindex.Index.create().parse(self.path, args=arguments)
        problems = [d for d in unit.diagnostics if d.severity >= cindex.Diagnostic.Error]
        if problems:
            raise SystemExit(f"{path}: libclang does not compile it: {problems[0].spelling} ({problems[0].location})")
        for cursor in unit.cursor.get_children():
            if cursor.location.file and cursor.location.file.name == self.path:
                self.visit(cursor, "", None, False, False)

    # ---- the source ----

    def range(self, cursor):
        return cursor.extent.start.offset, cursor.extent.end.offset

    def text(self, start, end):
        return self.bytes[start:end].decode()

    def of(self, cursor):
        return self.text(*self.range(cursor))

    def inside_macro(self, cursor):
        """True if the text of the cursor is not the cursor's own: it comes from a macro, or is one's argument."""
        start, end = self.range(cursor)
        return end <= start or cursor.location.file is None or cursor.location.file.name != self.path or any(
            first <= start < last for first, last in self.macros)

    @property
    def macros(self):
        if not hasattr(self, "macros_"):
            self.macros_ = []
            for match in re.finditer(r"\b(assert|static_assert|[A-Z][A-Z0-9]+_[A-Z0-9_]+)\(", self.source):
                start = len(self.source[:match.start()].encode())
                self.macros_.append((start, self.closing(len(self.source[:match.end() - 1].encode()))))
        return self.macros_

    def closing(self, at):
        """The offset of the parenthesis that closes the one at `at`."""
        depth = 0
        for offset in range(at, len(self.bytes)):
            depth += {40: 1, 41: -1}.get(self.bytes[offset], 0)
            if depth == 0:
                return offset
        return len(self.bytes)

    def operator_of(self, cursor):
        """(left, operator, right) of an expression with two operands, else None."""
        children = list(cursor.get_children())
        if cursor.kind == K.CALL_EXPR:
            if not cursor.spelling.startswith("operator") or len(children) != 3:
                return None
            operands = [c for c in children if c.kind == K.CALL_EXPR or not c.spelling.startswith("operator")]
            if len(operands) != 2:
                return None
            left, right = sorted(operands, key=lambda c: c.extent.start.offset)
        elif len(children) == 2:
            left, right = children
        else:
            return None
        between = self.text(self.range(left)[1], self.range(right)[0])
        operator = re.sub(r"//[^\n]*\n", "", between).strip()
        return left, operator, right

    @staticmethod
    def is_number(cursor):
        return cursor.type.get_canonical().kind in NUMBERS

    def is_by_value(self, cursor):
        return cursor.type.get_canonical().kind in NUMBERS | {T.ENUM, T.POINTER}

    # ---- the sites ----

    def add(self, span, rank, holes, mutants, write, context):
        function, constant = context
        self.sites.append(Site(span[0], span[1], rank, holes, mutants, write, function, constant))

    def flip(self, cursor, context):
        """The opposite of a condition, unless a comparison has this mutant itself."""
        span = self.range(cursor)
        if self.inside_macro(cursor) or any((s.start, s.end, s.rank) == (*span, 1) for s in self.sites):
            return
        inner = cursor
        while inner.kind in (K.PAREN_EXPR, K.UNEXPOSED_EXPR):
            children = list(inner.get_children())
            if len(children) != 1:
                break
            inner = children[0]
        parts = self.operator_of(inner) if inner.kind in (K.BINARY_OPERATOR, K.CALL_EXPR, K.UNEXPOSED_EXPR) else None
        if parts and parts[1] in (*COMPARISONS, "==", "!="):
            return
        if self.of(cursor) in ("true", "false"):
            return
        self.add(span, 1, [span], [(self.of(cursor), f"!({self.of(cursor)})")],
                 lambda holes, n: f"{S}Flip({n[0]}, static_cast<bool>({holes[0]}))", context)

    def binary(self, cursor, parts, context):
        left, operator, right = parts
        if self.inside_macro(cursor) or self.inside_macro(left) or self.inside_macro(right):
            return
        span, holes = self.range(cursor), [self.range(left), self.range(right)]
        was = self.of(cursor)
        became = lambda other: f"{self.text(*holes[0])} {other} {self.text(*holes[1])}"
        if operator in COMPARISONS:
            name, shifted, negated = COMPARISONS[operator]
            by_value = self.is_by_value(left) and self.is_by_value(right)
            name += "" if by_value else "Ref"
            self.add(span, 2, holes, [(was, became(shifted)), (was, became(negated))],
                     lambda h, n: f"{S}{name}({n[0]}, {n[1]}, {h[0]}, {h[1]})", context)
            self.literals((left, right), context)
        elif operator in ("==", "!="):
            self.add(span, 2, [span], [(was, became("!=" if operator == "==" else "=="))],
                     lambda h, n: f"{S}Flip({n[0]}, ({h[0]}))", context)
            self.literals((left, right), context)
        elif operator in ("&&", "||"):
            start = "" if operator == "&&" else "!"
            # The left operand decides alone, or the right one decides: the mutant exchanges when.
            self.add(span, 2, holes, [(was, became("||" if operator == "&&" else "&&"))],
                     lambda h, n: (f"({S}Flip({n[0]}, {start}static_cast<bool>({h[0]})) ? static_cast<bool>({h[1]}) : "
                                   f"{'' if operator == '&&' else '!'}{S}Is({n[0]}))"), context)
            self.flip(left, context)
            self.flip(right, context)
        elif operator in ARITHMETIC and self.is_number(left) and self.is_number(right):
            name, other = ARITHMETIC[operator]
            floating = {cursor.type.get_canonical().kind, T.FLOAT, T.DOUBLE}
            if operator == "%" and floating & {T.FLOAT, T.DOUBLE} == set():
                return
            self.add(span, 2, holes, [(was, became(other))], lambda h, n: f"{S}{name}({n[0]}, {h[0]}, {h[1]})", context)
            self.literals((left, right), context)
        elif operator in ASSIGNMENTS and self.is_number(left) and self.is_number(right):
            name, other = ASSIGNMENTS[operator]
            self.add(span, 2, holes, [(was, became(other))], lambda h, n: f"{S}{name}({n[0]}, {h[0]}, {h[1]})", context)

    def literals(self, cursors, context):
        """Constants one greater."""
        for cursor in cursors:
            while cursor.kind == K.UNEXPOSED_EXPR and len(list(cursor.get_children())) == 1:
                cursor = next(cursor.get_children())
            text = self.of(cursor)
            if cursor.kind == K.INTEGER_LITERAL and re.match(r"[0-9]", text) and not self.inside_macro(cursor):
                span = self.range(cursor)
                self.add(span, 1, [span], [(text, f"{text} + 1")], lambda h, n: f"{S}Next({n[0]}, {h[0]})", context)
                self.sites[-1].mutants = [(self.around(span), f"{text} + 1")]

    def around(self, span):
        """The line's text about a constant, which alone would not identify it."""
        begin = self.bytes.rfind(b"\n", 0, span[0]) + 1
        end = self.bytes.find(b"\n", span[1])
        return f"{text_key(self.text(begin, span[0]))}[{self.text(*span)}]{text_key(self.text(span[1], end))}"

    def with_semicolon(self, cursor):
        start, end = self.range(cursor)
        match = re.match(rb"\s*;", self.bytes[end:end + 200])
        return (start, end + match.end()) if match else None

    def statement(self, cursor, context):
        """Drops a statement that is an expression, or a jump."""
        if self.inside_macro(cursor):
            return
        if cursor.kind in (K.BREAK_STMT, K.CONTINUE_STMT) or (cursor.kind == K.RETURN_STMT and not list(cursor.get_children())):
            span = self.with_semicolon(cursor)
            if span and self.range(cursor) not in self.last_jumps:
                was = self.of(cursor) + " after " + shortened(self.before(span[0]), 60)
                self.add(span, 0, [span], [(was, "")], lambda h, n: f"{{ if (!{S}Is({n[0]})) {h[0]} }}", context)
        elif cursor.kind.is_expression() and self.with_semicolon(cursor) and not NOT_DROPPED.search(self.of(cursor)):
            span = self.range(cursor)
            self.add(span, 0, [span], [(self.of(cursor) + ";", "")],
                     lambda h, n: f"({S}Is({n[0]}) ? static_cast<void>(0) : static_cast<void>({h[0]}))", context)

    def before(self, at):
        begin = max(self.bytes.rfind(b"\n", 0, self.bytes.rfind(b"\n", 0, at)), 0)
        return self.text(begin, at)

    def returned(self, cursor, result, context):
        """Another value than the one that is returned."""
        children = list(cursor.get_children())
        if not children or result is None or self.inside_macro(cursor):
            return
        span, hole, kind = self.with_semicolon(cursor), self.range(children[0]), result.get_canonical().kind
        was = self.text(*hole)
        if kind == T.BOOL:
            if was in ("true", "false"):
                other = "false" if was == "true" else "true"
                self.add(hole, 1, [hole], [("return " + was + " after " + shortened(self.before(hole[0]), 60), other)],
                         lambda h, n: f"{S}Flip({n[0]}, {h[0]})", context)
            else:
                self.flip(children[0], context)
            return
        if span is None or kind in (T.VOID, T.LVALUEREFERENCE, T.RVALUEREFERENCE, T.DEPENDENT):
            return
        other = "{}"
        if self.is_zero(children[0], was):
            if kind == T.ENUM:
                other = "static_cast<decltype(" + was + ")>(1)"
            elif kind in NUMBERS:
                other = "1"
            else:
                return
        elif DEFAULTS.match(was):
            return
        self.add(span, 0, [hole], [(f"return {was}", f"return {other}")],
                 lambda h, n: f"{{ if ({S}Is({n[0]})) return {other}; return {h[0]}; }}", context)

    @staticmethod
    def is_zero(cursor, text):
        while cursor.kind == K.UNEXPOSED_EXPR and len(list(cursor.get_children())) == 1:
            cursor = next(cursor.get_children())
        referenced = cursor.referenced
        if referenced is not None and referenced.kind == K.ENUM_CONSTANT_DECL:
            return referenced.enum_value == 0
        return re.fullmatch(r"0[uU]?|0\.0?", text) is not None

    # ---- the walk ----

    def condition_of(self, cursor, children):
        """The condition of an if, while, do, for or ?:, unless it declares a variable or is known when compiling."""
        start, end = self.range(cursor)
        if cursor.kind == K.CONDITIONAL_OPERATOR:
            return children[0]
        if cursor.kind == K.FOR_STMT:
            opened = self.bytes.index(b"(", start)
            marks = [i for i in range(opened, self.closing(opened)) if self.bytes[i] == 59]
            if len(marks) != 2:
                return None
            return next((c for c in children if marks[0] < self.range(c)[0] and self.range(c)[1] <= marks[1]), None)
        head = self.text(start, start + 20)
        if head.startswith("if constexpr"):
            return None
        opened = self.bytes.index(b"(", start)
        declared = [self.range(c) for c in children if c.kind in (K.VAR_DECL, K.DECL_STMT)]
        candidates = [c for c in children if c.kind.is_expression() and opened < self.range(c)[0] and
                      self.range(c)[1] <= self.closing(opened)]
        found = candidates[-1] if candidates else None
        if found and any(a <= self.range(found)[0] < b for a, b in declared):
            return None
        return found

    def is_statement(self, cursor, parent, position):
        if parent is None:
            return False
        if parent.kind == K.COMPOUND_STMT:
            return True
        if parent.kind in (K.CASE_STMT, K.DEFAULT_STMT):
            return position == len(list(parent.get_children())) - 1
        if parent.kind in (K.IF_STMT, K.FOR_STMT, K.WHILE_STMT, K.DO_STMT, K.CXX_FOR_RANGE_STMT):
            opened = self.bytes.index(b"(", self.range(parent)[0])
            return self.range(cursor)[0] > self.closing(opened)
        return False

    def visit(self, cursor, function, result, constant, inside):
        kind = cursor.kind
        if kind in (K.STATIC_ASSERT, K.ENUM_DECL, K.PARM_DECL):
            return
        if kind == K.VAR_DECL and re.match(r"(static |inline )*constexpr\b|constinit\b", self.of(cursor)):
            constant = True
        if kind in FUNCTIONS:
            parent = cursor.semantic_parent
            own = parent.spelling + "::" if parent and parent.kind in (K.CLASS_DECL, K.STRUCT_DECL) else ""
            function, result, inside = own + cursor.spelling, cursor.result_type, True
            constant = re.match(r"[^({]*\bconst(expr|eval)\b", self.of(cursor)) is not None
        children = list(cursor.get_children())
        if kind == K.SWITCH_STMT and children[-1].kind == K.COMPOUND_STMT:
            self.last_jumps |= {self.range(c) for c in list(children[-1].get_children())[-1:]}
        if kind == K.LAMBDA_EXPR:
            result, inside = inferred(cursor), True
        context = (function, constant)
        if inside:
            self.sites_of(cursor, children, result, context)
        for position, child in enumerate(children):
            if kind == K.CASE_STMT and position == 0:
                continue
            if inside and self.is_statement(child, cursor, position):
                self.statement(child, context)
            self.visit(child, function, result, constant, inside)

    def sites_of(self, cursor, children, result, context):
        kind = cursor.kind
        if kind in (K.IF_STMT, K.WHILE_STMT, K.DO_STMT, K.FOR_STMT, K.CONDITIONAL_OPERATOR) and not self.inside_macro(cursor):
            condition = self.condition_of(cursor, children)
            if condition is not None:
                self.flip(condition, context)
        elif kind == K.RETURN_STMT:
            self.returned(cursor, result, context)
        elif kind == K.UNARY_OPERATOR and not self.inside_macro(cursor):
            text = self.of(cursor)
            if text[:2] in ("++", "--") and self.is_number(cursor):
                name, other = ("Increment", "--") if text[:2] == "++" else ("Decrement", "++")
                hole = self.range(children[0])
                self.add(self.range(cursor), 2, [hole], [(text, other + text[2:])],
                         lambda h, n: f"{S}{name}({n[0]}, {h[0]})", context)
        elif kind == K.ARRAY_SUBSCRIPT_EXPR and len(children) == 2:
            self.literals(children[1:], context)
        if kind in (K.BINARY_OPERATOR, K.COMPOUND_ASSIGNMENT_OPERATOR, K.CALL_EXPR, K.UNEXPOSED_EXPR):
            parts = self.operator_of(cursor)
            if parts is None:
                return
            if kind == K.CALL_EXPR and cursor.spelling == "operator[]":
                self.literals([c for c in children if c.kind != K.DECL_REF_EXPR or c.spelling != "operator[]"][1:], context)
            elif not any((s.start, s.end, s.rank) == (*self.range(cursor), 2) for s in self.sites):
                self.binary(cursor, parts, context)


def inferred(cursor):
    """bool, if a lambda returns conditions; other results of lambdas are not swapped."""
    found = []

    def search(node):
        for child in node.get_children():
            if child.kind == K.RETURN_STMT:
                found.extend(c.type for c in child.get_children())
            elif child.kind != K.LAMBDA_EXPR:
                search(child)
    search(cursor)
    return found[0] if found and all(t.get_canonical().kind == T.BOOL for t in found) else None


def find(path, arguments):
    """The sites of a source, the outer ones first."""
    with open(path, encoding="utf-8") as file:
        source = file.read()
    sites = Finder(path, arguments, source).sites
    unique = {}
    for site in sites:
        unique.setdefault((site.start, site.end, site.rank), site)
    return source, sorted(unique.values(), key=lambda s: (s.start, -s.end, s.rank))


def render(source, sites):
    """The source with all mutants. Every line keeps its number."""
    data = source.encode()

    def part(start, end, within):
        out, at, index = [], start, 0
        while index < len(within):
            site = within[index]
            inner = index + 1
            while inner < len(within) and within[inner].start < site.end:
                inner += 1
            out.append(data[at:site.start].decode())
            nested = within[index + 1:inner]
            holes, newlines = [], data[site.start:site.end].count(b"\n")
            for first, last in site.holes:
                holes.append(part(first, last, [s for s in nested if first <= s.start and s.end <= last]))
                newlines -= data[first:last].count(b"\n")
            out.append(site.write(holes, [str(n) for n in site.numbers]) + "\n" * newlines)
            at, index = site.end, inner
        out.append(data[at:end].decode())
        return "".join(out)

    return '#include "tests/mutation/schema.h"\n#line 1\n' + part(0, len(data), sites)

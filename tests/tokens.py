"""Size of the sources in tokens, which neither a formatter nor comments change.

Not counted are comments, docstrings, line ends, brackets and commas. `python tests/tokens.py`
writes the sizes of today into `budget.toml`.
"""

import ast
import io
import tokenize
from pathlib import Path

ROOT = Path(__file__).parents[1]
BUDGET = ROOT / "budget.toml"

_NOT_COUNTED = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}
_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def tokens_of(text: str) -> int:
    """Count the tokens of a source."""
    documented: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]
            documented |= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return sum(
        token.type not in _NOT_COUNTED
        and token.start[0] not in documented
        and not (token.type == tokenize.OP and token.string in "()[]{},")
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
    )


def sizes() -> dict[str, int]:
    """Count the tokens of every folder of notchflex; "." is what lies outside the folders."""
    source = ROOT / "src" / "notchflex"
    folders: dict[str, int] = {".": 0}
    for file in sorted(source.rglob("*.py")):
        inside = file.relative_to(source).parts
        folder = inside[0] if len(inside) > 1 else "."
        count = tokens_of(file.read_text(encoding="utf-8"))
        folders[folder] = folders.get(folder, 0) + count
    return folders


if __name__ == "__main__":
    head = "# Tokens of each folder of src/notchflex, as `python tests/tokens.py` counts them.\n"
    head += "# They only ever fall: what grows in one place goes in another.\n"
    lines = [f'"{folder}" = {count}' for folder, count in sizes().items()]
    BUDGET.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")

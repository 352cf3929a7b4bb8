"""What came of one case in the guest that ran last; exit code 0 when it passed.

    outcome.py RESULTS_FILE CASE"""

import json
import pathlib
import sys


def main():
    case = json.loads(pathlib.Path(sys.argv[1]).read_text()).get(sys.argv[2])
    if case is None:
        return f"{sys.argv[2]} did not run in the guest: see the output of vm.guest"
    print(f"{case['seconds']} s in the guest")
    return case["failure"] or 0


if __name__ == "__main__":
    sys.exit(main())

"""Prints how many cases the unit tests of a build ran, from the results that the programs wrote.

Usage: count_cases.py BUILD"""

import json
import pathlib
import sys


def main(build):
    results = [json.loads(file.read_text()) for file in sorted((pathlib.Path(build) / "results").glob("*.json"))]
    cases = [case for result in results for suite in result["testsuites"] for case in suite["testsuite"] if case["status"] == "RUN"]
    failed = sum("failures" in case for case in cases)
    print(f"unit tests: {len(cases)} cases in {len(results)} runs of test programs, {failed} failed")
    return 1 if failed or not cases else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))

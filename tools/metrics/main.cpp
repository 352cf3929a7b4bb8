#include <iostream>

#include "tools/metrics/busy_machine_fixture.h"
#include "tools/metrics/metrics_text.h"

// Prints the metrics of the tests' machine, for Prometheus' own tools to judge.
int main() {
  std::cout << axlecast::MetricsText(axlecast::BusyMachine(), axlecast::kBusyNow, "1.2.3");
  return std::cout.good() ? 0 : 1;
}

#include "tools/axlecast/fleet/ship_metrics.h"

#include "tools/metrics/metrics_text.h"

namespace axlecast {

std::string ShipMetricsText(const ShipStatus& status) {
  using enum Exposition::Type;
  Exposition text;
  text.Family(
      "axlecast_ship_lag_seconds", kGauge,
      "Age of the newest message in the database, of the log that is being written and is furthest behind.");
  text.Add({}, static_cast<double>(status.lag_us) / 1e6);
  text.Family("axlecast_ship_lag_bytes", kGauge, "Bytes of logs that are not in the database yet.");
  text.Add({}, status.lag_bytes);
  text.Family("axlecast_ship_holes_total", kCounter, "Holes that this shipper has recorded.");
  text.Add({}, status.holes);
  text.Family("axlecast_ship_database_up", kGauge, "1 if connected to the database.");
  text.Add({}, std::int64_t{status.connected});
  text.Family("axlecast_ship_batches_total", kCounter, "Acknowledged batches.");
  text.Add({}, status.batches);
  return text.text();
}

}  // namespace axlecast

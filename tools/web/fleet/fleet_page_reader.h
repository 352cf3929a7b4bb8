#pragma once

#include <optional>
#include <string>

#include "core/base/result.h"
#include "core/base/time.h"
#include "platform/db/database.h"
#include "tools/web/fleet/fleet_curve.h"
#include "tools/web/fleet/fleet_curve_source.h"
#include "tools/web/fleet/fleet_table.h"
#include "tools/web/fleet_request.h"

namespace axlecast {

// Answers questions of the page from the fleet database, which it only reads: as the role axlecast_reader, in transactions
// that cannot write. Connects when it is asked. After a failed connection it answers for kPause without trying again, so that
// the questions of all browsers do not each wait for a dead server. Blocks; for one thread.
class FleetPageReader {
 public:
  static constexpr MonoNs kPause = 2 * kSecond;
  static constexpr MonoNs kConnectLimit = 3 * kSecond;
  static constexpr MonoNs kStatementLimit = 12 * kSecond;
  static constexpr MonoNs kMachinesLast = 2 * kSecond;  // greatest age of the list of machines
  static constexpr int kServerLimitMs = 10'000;         // the server ends a statement after this time

  // `secrets` and `clock` must outlive it. `settings`: connection, password and stop; the rest is set here.
  FleetPageReader(db::DatabaseSettings settings, SecretSource& secrets, const Clock& clock);

  // Returns the frame that answers the request; of an error too.
  [[nodiscard]] std::string Answer(const FleetRequest& request);

 private:
  [[nodiscard]] db::DatabaseResult<> Connect();
  [[nodiscard]] db::DatabaseResult<std::string> Ask(const FleetRequest& request);
  [[nodiscard]] db::DatabaseResult<db::Rows> AskMachines(const FleetTable& table);
  [[nodiscard]] db::DatabaseResult<std::string> AskCurve(const FleetRequest& request);
  [[nodiscard]] db::DatabaseResult<FleetCurve> ReadSource(const FleetRequest& request, const CurveColumn& column,
                                                          CurveSource source);

  db::Database database_;
  const Clock& clock_;
  std::optional<db::DatabaseError> away_;  // why there is no connection
  MonoNs tried_ = 0;                       // when it was noticed
  std::optional<db::Rows> machines_;       // the newest list, for all browsers
  MonoNs machines_at_ = 0;
};

}  // namespace axlecast

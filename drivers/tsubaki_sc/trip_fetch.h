#pragma once

#include <optional>
#include <string>

#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/trip_reader.h"

namespace axlecast::tsubaki_sc {

// fetch_trip_logs: reads the logs of the last three trips at once and publishes them.
class TripFetch final : public Procedure {
 public:
  TripFetch(const Requests& requests, TripReader& trips) : requests_(requests), trips_(trips) {}

  // The unit's live turns read the logs too. When they have completed the last one, no log is left to ask for.
  [[nodiscard]] Exchange Next() const override {
    return requests_.Read(begun_ && trips_.wanted() ? trips_.Next() : kStatus);
  }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;

 private:
  [[nodiscard]] std::optional<Outcome> OnStatus(const Answer& answer);
  [[nodiscard]] Outcome Done() const;

  const Requests& requests_;
  TripReader& trips_;
  bool begun_ = false;
  int failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc

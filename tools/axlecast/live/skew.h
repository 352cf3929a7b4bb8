#pragma once

#include <axlecast/position_set_t.hpp>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/base/exchange_stats.h"
#include "core/base/time.h"

namespace axlecast {

// How far apart several axes were sampled, over many ticks: for `axlecast skew`. Pure.
class SkewStatistics {
 public:
  explicit SkewStatistics(std::vector<std::string> axes);

  // `set` has the axes of the constructor, in their order.
  void On(const position_set_t& set);

  [[nodiscard]] std::int64_t ticks() const { return ticks_; }
  [[nodiscard]] std::vector<std::string> Lines() const;
  [[nodiscard]] nlohmann::ordered_json ToJson() const;

 private:
  struct Axis {
    std::string device;
    std::int64_t good = 0;
    std::int64_t missing = 0;
    std::int64_t not_valid = 0;
    std::int64_t time_unknown = 0;
    double sum_ns = 0;            // of the residuals: sampling instant minus tick
    ExchangeStats distance = {};  // of the sampling instants to their ticks, either way
    ExchangeStats half_width = {};

    [[nodiscard]] double MeanNs() const { return good == 0 ? 0 : sum_ns / static_cast<double>(good); }
  };

  [[nodiscard]] double Share(std::int64_t count) const;

  std::vector<Axis> axes_;
  std::int64_t ticks_ = 0;
  std::int64_t aligned_ = 0;
  std::int64_t incomplete_ = 0;
  MonoNs limit_ = 0;
  ExchangeStats hull_;  // of the complete ticks
};

}  // namespace axlecast

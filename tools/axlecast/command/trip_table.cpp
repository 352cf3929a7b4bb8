#include "tools/axlecast/command/trip_table.h"

#include <cstdint>
#include <iterator>
#include <limits>

#include "core/base/text.h"
#include "core/messages/enum_names.h"
#include "tools/axlecast/common/utc_text.h"

namespace axlecast {
namespace {

std::string TimeText(std::int64_t utime) { return UtcText(utime) + " UTC"; }

std::string StartText(const trip_log_t& trip) {
  if (trip.not_before_utime == 0 && trip.not_after_utime == 0) return "at an unknown time";
  if (trip.not_before_utime == 0) return "before " + TimeText(trip.not_after_utime);
  if (trip.not_after_utime == 0) return "after " + TimeText(trip.not_before_utime);
  return "between " + TimeText(trip.not_before_utime) + " and " + TimeText(trip.not_after_utime);
}

std::string Heading(bool in_seconds) {
  std::string text = Right(in_seconds ? "s" : "sample", 7);
  for (const char* column : {"V", "A", "W", "degC", "x m/s2", "y m/s2", "z m/s2"}) text += ' ' + Right(column, 8);
  return text + '\n';
}

std::string SampleRow(const trip_log_t& trip, std::size_t sample) {
  std::string text = Right(Decimal(TripTime(trip, sample), trip.interval_us > 0 ? 1 : 0), 7);
  for (std::size_t quantity = 0; quantity < std::size(kTripQuantities); ++quantity) {
    text += ' ' + Right(Decimal(TripSample(trip, quantity, sample), kTripQuantities[quantity].decimals), 8);
  }
  return text + (sample + 1 == kTripSamples ? "  trip\n" : "\n");
}

}  // namespace

double TripSample(const trip_log_t& trip, std::size_t quantity, std::size_t sample) {
  if ((static_cast<unsigned>(trip.valid_mask) >> quantity & 1U) == 0) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return static_cast<double>(trip.samples[quantity][sample]);
}

double TripTime(const trip_log_t& trip, std::size_t sample) {
  const double samples = static_cast<double>(sample) - static_cast<double>(kTripSamples - 1);
  return trip.interval_us > 0 ? samples * trip.interval_us / 1e6 : samples;
}

std::string TripTitle(const trip_log_t& trip) {
  const std::string factors = MotorStatusNames(trip.factor_bits);
  return (trip.trip_count > 0 ? "trip " + std::to_string(trip.trip_count) : "a trip") + ", " +
         (factors.empty() ? "cause unknown" : factors);
}

std::string TripTable(const std::string& device, const std::vector<trip_log_t>& trips) {
  std::string text;
  for (const trip_log_t& trip : trips) {
    text += (text.empty() ? "" : "\n") + device + ": " + TripTitle(trip) + ", " + StartText(trip) + '\n' +
            Heading(trip.interval_us > 0);
    for (std::size_t sample = 0; sample < kTripSamples; ++sample) text += SampleRow(trip, sample);
  }
  return text;
}

}  // namespace axlecast

#include "drivers/hal/gpio_line.h"

#include <gpiod.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "core/device/link.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr const char* kConsumer = "axlecast";

// "line clk (/dev/gpiochip0 17)"
std::string Name(const PulseLineConfig& line) {
  return "line " + line.name + " (" + line.chip + ' ' + std::to_string(line.offset) + ')';
}

std::string ChipProblem(const PulseLineConfig& line, int error) {
  switch (error) {
    case ENOENT:
      return Name(line) + ": there is no such chip; gpiodetect lists this machine's";
    case EACCES:
    case EPERM:
      return Name(line) +
             ": permission denied; let the user use GPIO (as root: usermod -aG gpio USER; where no group gpio is, "
             "a "
             "udev rule gives " +
             line.chip + " to one) and log in again";
    case ENOTTY:
    case ENODEV:
      return Name(line) + ": that is no GPIO chip; gpiodetect lists this machine's";
    default:
      return Name(line) + ": " + std::strerror(error);
  }
}

}  // namespace

// A claimed line: driven, until it goes.
class GpioLines::Line {
 public:
  explicit Line(gpiod_chip* chip) : chip_(chip) {}
  ~Line() {
    if (requested_) gpiod_line_release(line_);
    gpiod_chip_close(chip_);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  [[nodiscard]] std::string Request(const PulseLineConfig& config) {
    line_ = gpiod_chip_get_line(chip_, static_cast<unsigned>(config.offset));
    if (line_ == nullptr) {
      return Name(config) + ": the chip has lines 0 to " + std::to_string(int(gpiod_chip_num_lines(chip_)) - 1) +
             "; gpioinfo lists them";
    }
    requested_ = gpiod_line_request_output(line_, kConsumer, 1) == 0;
    return requested_ ? "" : RequestProblem(config, errno);
  }
  [[nodiscard]] bool Set(bool high) { return gpiod_line_set_value(line_, high ? 1 : 0) == 0; }

 private:
  [[nodiscard]] std::string RequestProblem(const PulseLineConfig& config, int error) {
    if (error != EBUSY) return ChipProblem(config, error);
    // The name may have been read before the other one took the line.
    const char* const consumer = gpiod_line_update(line_) == 0 ? gpiod_line_consumer(line_) : nullptr;
    return Name(config) + (consumer == nullptr ? "" : ", taken by '" + std::string(consumer) + "'") + ": " +
           std::string(kLineHeld);
  }

  gpiod_chip* chip_;
  gpiod_line* line_ = nullptr;
  bool requested_ = false;
};

GpioLines::GpioLines(std::vector<PulseLineConfig> lines, const Clock& clock)
    : lines_(std::move(lines)), clock_(clock) {}

GpioLines::~GpioLines() = default;

void GpioLines::Close() { claimed_.clear(); }

std::string GpioLines::Open() {
  Close();
  std::string problem;
  for (const PulseLineConfig& line : lines_) {
    if (problem.empty()) problem = Claim(line);
  }
  if (!problem.empty()) Close();
  return problem;
}

std::string GpioLines::Claim(const PulseLineConfig& config) {
  gpiod_chip* const chip = gpiod_chip_open(config.chip.c_str());
  if (chip == nullptr) return ChipProblem(config, errno);
  claimed_.push_back(std::make_unique<Line>(chip));
  return claimed_.back()->Request(config);
}

bool GpioLines::Pulse(std::uint8_t line, MonoNs low) {
  if (line >= claimed_.size()) return false;
  // High again even where low was refused.
  const bool was_low = claimed_[line]->Set(false);
  WaitUntil(clock_.Now() + low, clock_);
  return claimed_[line]->Set(true) && was_low;
}

}  // namespace axlecast

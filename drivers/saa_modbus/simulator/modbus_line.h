#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/device/line_settings.h"
#include "core/device/simulator.h"
#include "drivers/kit/simulation/script.h"
#include "drivers/saa_modbus/simulator/simulated_encoder.h"

namespace axlecast::saa_modbus {

// SAA encoders on one Modbus line, after the manual's 5.1.7: a frame ends with 3.5 characters of silence, and what
// comes sooner after other traffic belongs to that; a frame with a wrong CRC, for another address, or that is none
// of the manual's is not answered. Each encoder has its own baud rate: at another one than the host's it hears
// noise and is heard as noise. Two that answer at once destroy each other's replies. The instants must not run
// backwards.
class SaaModbusSimulator final : public Simulator {
 public:
  struct Line {
    LineFormat format{.baud = 19'200};  // of the host, until OnBaud says otherwise
    bool echo = false;                  // the adapter hears its own transmission
    bool paced = true;                  // frames take their time on the wire and need their pauses
  };
  // Traffic of one encoder since the start.
  struct Counters {
    std::int64_t requests = 0;    // understood and carried out
    std::int64_t replies = 0;     // handed to the line, damaged or not
    std::int64_t ignored = 0;     // for it, but none of the manual's requests
    std::int64_t bad_crc = 0;     // frames, whoever they were for
    std::int64_t noise = 0;       // frames at another baud rate
    std::int64_t unanswered = 0;  // by a fault
    std::int64_t collisions = 0;  // replies destroyed because another one transmitted
  };

  explicit SaaModbusSimulator(const Line& line) : line_(line) {}
  void Add(std::string name, const SimulatedEncoder& encoder, Script script);

  void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) override;
  void OnBaud(std::int64_t baud) override;
  [[nodiscard]] MonoNs NextDue() const override;
  void OnDue(MonoNs now, const Transmit& transmit) override;
  [[nodiscard]] Result<> Set(std::string_view device, std::string_view key, std::string_view value,
                             MonoNs now) override;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view device,
                                                                       MonoNs now) const override;

  // Of the device at `index`, in the order of Add.
  [[nodiscard]] const SimulatedEncoder& encoder(std::size_t index) const { return units_.at(index).encoder; }
  [[nodiscard]] const Counters& counters(std::size_t index) const { return units_.at(index).counters; }
  // Host frames that came sooner than 3.5 characters after other traffic.
  [[nodiscard]] std::int64_t short_gaps() const { return short_gaps_; }

 private:
  struct Unit {
    std::string name;
    SimulatedEncoder encoder;
    Script script;
    Counters counters;
  };
  struct Pending {
    std::size_t unit = 0;
    MonoNs begins = 0;    // on the wire
    MonoNs ends = 0;      // on the wire
    MonoNs due = kNever;  // the host gets it
    std::int64_t baud = 0;
    Frame bytes;
    bool destroyed = false;
  };
  struct Answer {
    Frame bytes;
    std::int64_t baud = 0;
  };

  [[nodiscard]] MonoNs WireTime(std::size_t characters, std::int64_t baud) const;
  [[nodiscard]] MonoNs Gap() const;
  void CatchUp(MonoNs now);
  void FinishFrame(MonoNs now, const Transmit& transmit);
  void Hear(std::size_t index, MonoNs end, MonoNs now);
  [[nodiscard]] std::optional<Answer> Execute(Unit& unit, Bytes frame, MonoNs at);
  void Reply(std::size_t index, const Answer& answer, MonoNs request_end);
  void Collide(Pending& added);
  void SendDue(MonoNs now, const Transmit& transmit);

  Line line_;
  std::vector<Unit> units_;
  bool started_ = false;
  std::optional<std::int64_t> host_baud_;  // as OnBaud told
  Frame frame_;                            // of the host, so far
  bool frame_bad_ = false;                 // it ran into other traffic
  MonoNs frame_ends_ = kNever;             // with its silence
  MonoNs busy_until_ = 0;                  // last character on the wire, of whomever
  std::vector<Pending> pending_;
  LateAdapter adapter_;
  std::int64_t short_gaps_ = 0;
};

}  // namespace axlecast::saa_modbus

#pragma once

#include <string>
#include <vector>

#include "core/base/exchange_stats.h"
#include "platform/net/lcm_port.h"
#include "platform/os/mapped_file.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "platform/os/terminal.h"
#include "tools/axlecast/logs/replay_keys.h"
#include "tools/axlecast/logs/replay_text.h"
#include "tools/replay/replay.h"

namespace axlecast {

// Plays a replay on LCM, led by the keyboard where there is a terminal, until its end, the operator's, or a signal's.
class ReplayRun {
 public:
  // `logs`: what is replayed. `commands`: where command and permit channels go. With `shows` progress stands on standard
  // error.
  ReplayRun(Replay& replay, const std::vector<MappedFile>& logs, LcmPort& data, LcmPort& commands, bool shows);

  [[nodiscard]] ReplayOutcome Run();

 private:
  // Until something is due, or a key or a signal comes.
  void Wait();
  void PlayDue();
  void TakeKeys();
  void Obey(ReplayKey key);
  void SeekBy(std::int64_t seconds);
  void Show();
  // What is gone of the logs. Nothing is played any more then: messages could be zeros by now.
  [[nodiscard]] std::string Loss() const;

  Replay& replay_;
  const std::vector<MappedFile>& logs_;
  LcmPort& data_;
  LcmPort& commands_;
  bool shows_;
  SystemClock clock_;
  StopSignal stop_;
  TerminalKeys terminal_;
  ReplayKeys keys_;
  ExchangeStats late_;
  MonoNs next_show_ = 0;
  bool quit_ = false;
};

}  // namespace axlecast

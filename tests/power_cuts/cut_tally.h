#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tests/disk/recorded_disk.h"

namespace axlecast {

// A defect that is planted to show that the check finds it.
enum class PlantedFault : std::uint8_t {
  kNone,
  kNoSync,        // neither files nor folders are synced: SQLite with synchronous=OFF
  kNoFileSync,    // only folders are
  kNoFolderSync,  // only files are
  kEarlyClaim,    // what is written counts as durable before its sync
};

// One workload whose power is cut.
struct CutOrder {
  std::uint64_t seed = 1;  // selects the workload and the states
  int operations = 30;
  int restarts = 16;            // one operation in so many is a clean restart
  std::size_t stride = 1;       // cuts after every change, or after every second one, ...
  int random_states = 2;        // of each point, besides one that is aimed
  std::size_t second_cuts = 8;  // one state in so many loses its power again during the recovery; 0: none
  PlantedFault fault = PlantedFault::kNone;
};

// What the cuts have shown.
struct CutTally {
  std::int64_t points = 0;       // changes after which the power was cut
  std::int64_t states = 0;       // of the disk, each checked
  std::int64_t second_cuts = 0;  // of these states, after a cut during the recovery
  std::int64_t breaches = 0;
  std::vector<std::string> texts;  // of the first breaches

  void Breach(const std::string& text) {
    constexpr std::size_t kMaxTexts = 5;
    if (breaches++ < static_cast<std::int64_t>(kMaxTexts)) texts.push_back(text);
  }
  void Add(const CutTally& other) {
    points += other.points;
    states += other.states;
    second_cuts += other.second_cuts;
    breaches += other.breaches;
    texts.insert(texts.end(), other.texts.begin(), other.texts.end());
  }
};

// Plants the fault in the disk; an early claim is up to the workload.
inline void Plant(RecordedDisk& disk, PlantedFault fault) {
  const bool all = fault == PlantedFault::kNoSync;
  disk.IgnoreSyncs(all || fault == PlantedFault::kNoFileSync, all || fault == PlantedFault::kNoFolderSync);
}

// Checks the state of the disk in `folder` after a cut at `point`. Returns what is wrong; no text: nothing.
using CutCheck = std::function<std::string(std::size_t point, const std::string& folder)>;

// Cuts the power of the disk at its points, in states that `order` selects, and checks each state in `folder`.
inline void CutEverywhere(const RecordedDisk& disk, const CutOrder& order, const std::string& folder,
                          const CutCheck& check, CutTally& tally) {
  using Kind = CutChoice::Kind;
  std::mt19937_64 random(order.seed);
  const std::size_t end = disk.position();
  for (std::size_t point = order.seed % order.stride; point <= end; point += order.stride) {
    ++tally.points;
    std::vector<CutChoice> choices = {{static_cast<Kind>(random() % 3)}};
    for (int i = 0; i < order.random_states; ++i) choices.push_back({Kind::kRandom, random()});
    for (const CutChoice& choice : choices) {
      disk.Cut(point, choice, folder);
      ++tally.states;
      const std::string breach = check(point, folder);
      if (breach.empty()) continue;
      tally.Breach("seed " + std::to_string(order.seed) + ", before change " + std::to_string(point) + " (" +
                   disk.Describe(point) + "), state " + std::to_string(static_cast<int>(choice.kind)) + '/' +
                   std::to_string(choice.seed) + ": " + breach);
    }
  }
}

}  // namespace axlecast

#include "tools/mqtt/topic_map.h"

#include <gtest/gtest.h>

#include <regex>

namespace axlecast {
namespace {

// LIMITS had a topic and was not subscribed to.
TEST(MqttTopicMap, EveryChannelWithATopicIsSubscribedTo) {
  MachineConfig machine;
  machine.machine = "press3";
  BusConfig bus;
  bus.name = "rs485-0";
  bus.devices.emplace_back().name = "gm1";
  machine.buses.push_back(bus);
  TopicMap topics(machine);
  const std::regex subscribed(MqttDataChannels());
  for (const char* channel : {"POSITION/gm1", "MOTOR/gm1", "LIMITS/gm1", "TRIP/gm1", "DEVICE/gm1", "ALARM/gm1",
                              "BUS/rs485-0", "ALARM/bridge", "RECORDER/events"}) {
    EXPECT_TRUE(topics.Find(channel)) << channel;
    EXPECT_TRUE(std::regex_match(channel, subscribed)) << channel;
  }
  for (const char* channel : {"WIRE/rs485-0", "POSITION_BLOCK/gm1", "BUS_TIMES/rs485-0"}) {
    EXPECT_FALSE(topics.Find(channel)) << channel;
    EXPECT_FALSE(std::regex_match(channel, subscribed)) << channel;
  }
}

}  // namespace
}  // namespace axlecast

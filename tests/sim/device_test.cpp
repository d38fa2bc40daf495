#include "sim/device.h"

#include <gtest/gtest.h>

#include "data/files/error.h"

namespace flash::sim {
namespace {

const std::vector<std::string> three = {"", "too old", ""};

std::string refusal(const std::string& name, const std::vector<std::string>& why_not,
                    const std::string& why_none = "") {
  try {
    choose_device(name, why_not, why_none);
  } catch (const data::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ChooseDevice, TakesDevicesByNumber) {
  EXPECT_EQ(choose_device("cpu", three, "").device, Device::cpu);
  const DeviceChoice first = choose_device("cuda", three, "");
  EXPECT_EQ(first.device, Device::cuda);
  EXPECT_TRUE(first.cuda_devices.empty());
  EXPECT_EQ(choose_device("cuda:2", three, "").cuda_devices, std::vector<int>({2}));
  EXPECT_EQ(choose_device("cuda:2,0", three, "").cuda_devices, std::vector<int>({2, 0}));
  EXPECT_EQ(choose_device("cuda:all", three, "").cuda_devices, std::vector<int>({0, 2}));
}

TEST(ChooseDevice, TakesTheProcessorWhereItMay) {
  EXPECT_EQ(choose_device("auto", three, "").device, Device::cuda);
  EXPECT_EQ(choose_device("auto", {}, "no driver").device, Device::cpu);
  EXPECT_EQ(choose_device("cpu", {}, "no driver").device, Device::cpu);
}

TEST(ChooseDevice, NamesWhatIsNotThere) {
  EXPECT_EQ(refusal("cuda", {}, "no driver"), "--device cuda: no driver; use --device cpu or auto");
  EXPECT_EQ(refusal("cuda:all", {}, "no driver"), "--device cuda:all: no driver; use --device cpu or auto");
  EXPECT_EQ(refusal("cuda:0", {}, "no driver"), "--device cuda:0: no driver; use --device cpu or auto");
  EXPECT_EQ(refusal("cuda:all", {"too old"}, "too old"),
            "--device cuda:all: too old; use --device cpu or auto");
  EXPECT_EQ(refusal("cuda:3", three), "--device cuda:3: found no CUDA device 3, expected 0 to 2");
  EXPECT_EQ(refusal("cuda:1", {""}), "--device cuda:1: found no CUDA device 1, expected 0, the only one");
  EXPECT_EQ(refusal("cuda:1", three), "--device cuda:1: device 1 cannot be used (too old)");
  EXPECT_EQ(refusal("cuda:0,2,0", three), "--device cuda:0,2,0: found 0 twice, expected each device once");
  for (const char* name : {"cuda:", "cuda:0,", "cuda:a", "cuda:-1", "cuda:0 1", "cuda:99999999999"})
    EXPECT_NE(refusal(name, three).find("expected numbers of devices, as cuda:0,2, or cuda:all"),
              std::string::npos)
        << name;
  for (const char* name : {"gpu", "", "cuda0", "CUDA"})
    EXPECT_NE(refusal(name, three).find("expected auto, cpu, cuda"), std::string::npos) << name;
}

}  // namespace
}  // namespace flash::sim

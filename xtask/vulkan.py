"""Prints the name of every Vulkan device, one per line. Ends with 1 and a reason if there is none.

It asks the Vulkan loader, as the tests do. So the file of a driver for missing hardware does not
count, and the variables of the loader (VK_DRIVER_FILES, VK_ICD_FILENAMES) have an effect.
"""

import ctypes
import sys


class InstanceCreateInfo(ctypes.Structure):
    """VkInstanceCreateInfo. All fields but the type stay zero: no layers, no extensions."""

    _fields_ = [
        ("type", ctypes.c_uint32),
        ("next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("application", ctypes.c_void_p),
        ("layer_count", ctypes.c_uint32),
        ("layers", ctypes.c_void_p),
        ("extension_count", ctypes.c_uint32),
        ("extensions", ctypes.c_void_p),
    ]


INSTANCE_CREATE_INFO = 1  # VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO
INCOMPATIBLE_DRIVER = -9  # VK_ERROR_INCOMPATIBLE_DRIVER: the loader found no working driver
NAME_OFFSET = 20  # offset of deviceName in VkPhysicalDeviceProperties, after five 32-bit fields
PROPERTIES_BYTES = 4096  # VkPhysicalDeviceProperties needs less (824 bytes on 64-bit machines)


def load():
    """Loads the Vulkan loader."""
    for name in ("libvulkan.so.1", "libvulkan.so"):
        try:
            return ctypes.CDLL(name)
        except OSError:
            pass
    sys.exit("there is no Vulkan loader (libvulkan.so.1)")


def check(call, result):
    """Ends the program if a call of Vulkan failed."""
    if result == INCOMPATIBLE_DRIVER:
        sys.exit("the Vulkan loader finds no working driver")
    if result < 0:
        sys.exit(f"the Vulkan drivers have no device here ({call} ended with VkResult {result})")


def device_names(vulkan):
    """Returns the names of all physical devices."""
    instance = ctypes.c_void_p()
    info = InstanceCreateInfo(type=INSTANCE_CREATE_INFO)
    check("vkCreateInstance", vulkan.vkCreateInstance(ctypes.byref(info), None, ctypes.byref(instance)))
    count = ctypes.c_uint32()
    check(
        "vkEnumeratePhysicalDevices",
        vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None),
    )
    devices = (ctypes.c_void_p * count.value)()
    check(
        "vkEnumeratePhysicalDevices",
        vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), devices),
    )
    names = []
    for device in devices[: count.value]:
        properties = ctypes.create_string_buffer(PROPERTIES_BYTES)
        vulkan.vkGetPhysicalDeviceProperties(ctypes.c_void_p(device), properties)
        names.append(properties.raw[NAME_OFFSET:].split(b"\0")[0].decode(errors="replace"))
    vulkan.vkDestroyInstance(instance, None)
    return names


found = device_names(load())
if not found:
    sys.exit("the Vulkan drivers have no device here")
print("\n".join(found))

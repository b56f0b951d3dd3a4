"""The USB descriptors of a simulated bridge: one configuration, one mass-storage interface, one bulk pipe each way."""

from __future__ import annotations

from types import SimpleNamespace

from drivers.scsi.bulk_only import BULK_ONLY, MASS_STORAGE, TRANSPARENT_SCSI

BULK_IN, BULK_OUT = 0x81, 0x02
FULL_SPEED, HIGH_SPEED = 64, 512  # bytes of a bulk packet (USB 2.0 §5.8.3)
BULK = 0x02
CONFIGURATION = 1


def device_descriptor(vendor: int, product: int) -> SimpleNamespace:
    return SimpleNamespace(
        bLength=18, bDescriptorType=1, bcdUSB=0x0110, bDeviceClass=0, bDeviceSubClass=0, bDeviceProtocol=0,
        bMaxPacketSize0=8, idVendor=vendor, idProduct=product, bcdDevice=0x0100, iManufacturer=0, iProduct=0,
        iSerialNumber=0, bNumConfigurations=1, address=5, bus=1, port_number=2, port_numbers=(2,), speed=2,
    )  # fmt: skip


def configuration_descriptor(index: int) -> SimpleNamespace:
    if index != 0:
        raise IndexError(index)
    return SimpleNamespace(
        bLength=9, bDescriptorType=2, wTotalLength=32, bNumInterfaces=1, bConfigurationValue=CONFIGURATION,
        iConfiguration=0, bmAttributes=0x80, bMaxPower=50, extra_descriptors=[],
    )  # fmt: skip


def interface_descriptor(index: int, alternate: int) -> SimpleNamespace:
    if (index, alternate) != (0, 0):
        raise IndexError(index)
    return SimpleNamespace(
        bLength=9, bDescriptorType=4, bInterfaceNumber=0, bAlternateSetting=0, bNumEndpoints=2,
        bInterfaceClass=MASS_STORAGE, bInterfaceSubClass=TRANSPARENT_SCSI, bInterfaceProtocol=BULK_ONLY,
        iInterface=0, extra_descriptors=[],
    )  # fmt: skip


def endpoint_descriptor(index: int, packet_size: int) -> SimpleNamespace:
    address = (BULK_IN, BULK_OUT)[index]
    return SimpleNamespace(
        bLength=7, bDescriptorType=5, bEndpointAddress=address, bmAttributes=BULK, wMaxPacketSize=packet_size,
        bInterval=0, bRefresh=0, bSynchAddress=0, extra_descriptors=[],
    )  # fmt: skip

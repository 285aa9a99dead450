"""The searches, by the class of certificates that they attack."""

from tests.attacks import best, contacts, faces, limits, wrench_sets

TABLE = {
    "ClosureCertificate": contacts.CLOSURE,
    "a closure certificate with torsion": contacts.SOFT,
    "FrictionInterval": contacts.FRICTION,
    "Absence": faces.ABSENCE,
    "TwistCover": faces.COVER,
    "CertifiedRegions": faces.REGIONS,
    "FerrariCanny": wrench_sets.QUALITY,
    "ResistedLoads": wrench_sets.LOADS,
    "WrenchLimit": limits.LIMIT,
    "BestSqueeze": limits.SQUEEZE,
    "Payload": limits.PAYLOAD,
    "HandPayload": limits.HAND,
    "CutTree": best.TREE,
    "BestGrasp": best.BEST,
}
